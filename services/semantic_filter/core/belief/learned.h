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

/// True over assumed variances of the sides of boxes: of the errors that are new in each box, and
/// of those that last while the view hardly changes (b).
struct SideScales {
  double noise = 1.0, lasting = 1.0;
};

/// Evidence of the residuals of one fit about the logarithms of both scales [noise, lasting], at
/// the scales that the fit used.
struct SideEvidence {
  Eigen::Matrix2d information = Eigen::Matrix2d::Zero();  ///< Fisher's, doubled: about sides
  Eigen::Vector2d gradient = Eigen::Vector2d::Zero();     ///< of the log likelihood, doubled
};

/// The scales of the sides for each network, by Fisher scoring. Derivation:
/// tools/docs/maths/noise_scale.md.
class SideVariances {
 public:
  SideScales scales(std::uint64_t model) const;
  /// The assumption weighs `assumed` sides; 0: the scales stay 1.
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

  /// Returns true over assumed variance. The assumption weighs `assumed` residuals; 0: fixed.
  double ratio(std::uint64_t model, double assumed) const;
  /// `over` is relative to the first assumption, not to the present ratio.
  void learn(std::uint64_t model, const ResidualRatio& over);

 private:
  struct Sums {
    double squares = 0.0, count = 0.0;
  };
  double remembered_;
  std::vector<std::pair<std::uint64_t, Sums>> sums_;  ///< a list, because networks are few
};

/// Whether the boxes of a network that does not say it enclose outlines or images of cuboids. Boxes
/// count as images of cuboids until the evidence of objects at rest exceeds 6 nats. Derivation:
/// tools/docs/maths/box_extent.md.
class BoxExtents {
 public:
  bool outlines(std::uint64_t model) const { return of(model).outlines; }
  /// The evidence is so large that more of it is not needed.
  bool decided(std::uint64_t model) const;
  /// Adds nats for outlines.
  void learn(std::uint64_t model, double nats);

 private:
  struct Odds {
    double nats = 0.0;
    bool outlines = false;
  };
  Odds of(std::uint64_t model) const;
  std::vector<std::pair<std::uint64_t, Odds>> odds_;  ///< a list, because networks are few
};

/// For each network, the size at which P_D is halved, relative to the assumed one. By Fisher
/// scoring from the observations of confirmed objects at rest. Derivation:
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

/// Share of the instances of a class that move, learned from the objects of this drive beside the
/// prior, each once and when it can be judged. Derivation: tools/docs/maths/state_and_mixture.md.
class MoverShares {
 public:
  /// Counts a track if this was the detection at which tracks are judged.
  void learn(const Track& track, double min_speed);
  /// Returns the prior probability that an instance of the class moves; 0 stays 0.
  double of(const ClassPrior& prior) const;

 private:
  struct Counts {
    double moving = 0.0, all = 0.0;
  };
  std::shared_ptr<const std::map<std::string, Counts>> counts_;  ///< shared by copies of the belief
};

}  // namespace perdure::semantic_filter
