// Parameters that the filter learns during a drive: variances of networks and shares of movers.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "services/semantic_filter/core/belief/classes/class_prior.h"
#include "services/semantic_filter/core/belief/track.h"

namespace perdure::semantic_filter {

struct ResidualRatio {
  double ratio = 1.0;  ///< squared residuals over their variance, per degree of freedom
  double count = 0.0;  ///< number of new residuals; keyframes of an earlier fit do not count again
};

/// Ratios of the true to the assumed variances of the sides of boxes. `noise`: of errors that are
/// new in each box. `lasting`: of errors that last while the view hardly changes (b).
struct SideScales {
  double noise = 1.0, lasting = 1.0;
};

/// Evidence of the residuals of one fit about the logarithms of both scales [noise, lasting], at
/// the scales that the fit used.
struct SideEvidence {
  Eigen::Matrix2d information = Eigen::Matrix2d::Zero();  ///< Fisher's, doubled: number of sides
  Eigen::Vector2d gradient = Eigen::Vector2d::Zero();     ///< of the log likelihood, doubled
};

/// Learns the scales of the sides for each network by Fisher scoring. Derivation:
/// tools/docs/maths/noise_scale.md.
class SideVariances {
 public:
  SideScales scales(std::uint64_t model) const;
  /// The assumption weighs as much as `assumed` sides; 0: the scales stay 1.
  void learn(std::uint64_t model, const SideEvidence& evidence, double assumed);

 private:
  struct Estimate {
    Eigen::Vector2d logs = Eigen::Vector2d::Zero();
    Eigen::Matrix2d information = Eigen::Matrix2d::Zero();  ///< of all fits, without the assumption
  };
  std::vector<std::pair<std::uint64_t, Estimate>> estimates_;  ///< a list, because networks are few
};

/// Noise scale of azimuths: squared ratio of true to assumed errors, for each network. Derivation:
/// tools/docs/maths/noise_scale.md.
class NoiseScales {
 public:
  /// Remembers at most `remembered` residuals, because a network has other errors on another road.
  explicit NoiseScales(double remembered) : remembered_(remembered) {}

  /// Returns the ratio of the true to the assumed variance. The assumption weighs as much as
  /// `assumed` residuals; 0: the ratio is 1.
  double ratio(std::uint64_t model, double assumed) const;
  /// `over`: relative to the assumed variance, not to the variance by the present ratio.
  void learn(std::uint64_t model, const ResidualRatio& over);

 private:
  struct Sums {
    double squares = 0.0, count = 0.0;
  };
  double remembered_;
  std::vector<std::pair<std::uint64_t, Sums>> sums_;  ///< a list, because networks are few
};

/// Learns whether the boxes of a network enclose outlines or images of cuboids, if its model does
/// not state it. Boxes count as images of cuboids until the evidence of objects at rest exceeds 6
/// nats. Derivation: tools/docs/maths/box_extent.md.
class BoxExtents {
 public:
  bool outlines(std::uint64_t model) const { return of(model).outlines; }
  /// Whether the evidence is so large that no more is needed.
  bool decided(std::uint64_t model) const;
  /// Adds evidence; positive nats are for outlines, negative ones for images of cuboids.
  void learn(std::uint64_t model, double nats);

 private:
  struct Odds {
    double nats = 0.0;
    bool outlines = false;
  };
  Odds of(std::uint64_t model) const;
  std::vector<std::pair<std::uint64_t, Odds>> odds_;  ///< a list, because networks are few
};

/// Learns for each network the size at which P_D is halved, relative to the assumed one. It uses
/// Fisher scoring and the observations of confirmed objects at rest. Derivation:
/// tools/docs/maths/detectability.md.
class DetectionSizes {
 public:
  double scale(std::uint64_t model) const;
  void learn(std::uint64_t model, const SizeEvidence& evidence);

 private:
  struct Estimate {
    double log = 0.0, information = 0.0;  ///< of all observations, without the assumption
  };
  std::vector<std::pair<std::uint64_t, Estimate>> estimates_;  ///< a list, because networks are few
};

/// Share of the objects of a class that move, from the prior and the objects of this drive. Each
/// object counts once, at its 20th detection. Derivation: tools/docs/maths/state_and_mixture.md.
class MoverShares {
 public:
  /// Counts a track at its 20th detection, if it has been confirmed. `min_speed`: m/s.
  void learn(const Track& track, double min_speed);
  /// Returns the prior probability that an object of the class moves; 0 if the class prior is 0.
  double of(const ClassPrior& prior) const;

 private:
  struct Counts {
    double moving = 0.0, all = 0.0;
  };
  std::shared_ptr<const std::map<std::string, Counts>> counts_;  ///< shared by copies of the belief
};

}  // namespace perdure::semantic_filter
