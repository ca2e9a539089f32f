// Height of the ground, from objects that stand on it and the path of the body: a Gaussian process.
// Heights are along the view's up direction. Derivation: tools/docs/maths/ground_contact.md.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "common/base/inplace_vector.h"
#include "common/base/scratch.h"
#include "services/semantic_filter/core/belief/classes/class_prior.h"
#include "services/semantic_filter/core/belief/track.h"
#include "services/semantic_filter/core/parameters.h"

namespace perdure::semantic_filter {

struct GroundHeight {
  double mean = 0.0, variance = 0.0;  ///< m, m²
  double uneven = 0.0;                ///< m²; part of the variance, by slope and roughness
};

/// Unevenness of the ground relative to ground.slope and ground.roughness, learned from objects.
class GroundRoughness {
 public:
  /// Returns the ratio of the true to the assumed variance. The assumption weighs as much as
  /// `assumed` objects.
  double ratio(double assumed) const;
  /// Learns from an object that stands `above` (m) over the ground that the others predict.
  /// `share`: its weight, the share of new keyframes. `ratio`: as used for `others`.
  void learn(double above, const GroundHeight& others, double own_variance, double ratio,
             double share);

 private:
  double squares_ = 0.0, things_ = 0.0;
};

/// Recent positions of the body, a few metres apart. Part of the belief.
class BodyPath {
 public:
  static constexpr std::size_t kPlaces = 6;

  void advance(const Eigen::Vector3d& body);

  const Eigen::Vector3d* begin() const { return places_.begin(); }
  const Eigen::Vector3d* end() const { return places_.end(); }

 private:
  InplaceVector<Eigen::Vector3d, kPlaces> places_;  ///< the newest is last
};

class GroundSurface {
 public:
  /// Uses static tracks that very probably exist, whose boxes give the ground contact, and whose
  /// class stands on the ground. It also uses the path, if the height of the body is known.
  GroundSurface(const std::vector<Track>& tracks, const BodyPath& path,
                const GroundRoughness& roughness_scale, const Eigen::Vector3d& up_W,
                const ClassPriors& priors, const GroundParameters& parameters);

  /// Updates `roughness_scale` by the ground contact of the track. `share`: of new keyframes.
  void updateRoughness(GroundRoughness& roughness_scale, const Track& track, double share) const;
  /// Returns the height of the ground below `place` without track `except`; nothing if fewer than
  /// three objects contribute and the height of the body is not known.
  std::optional<GroundHeight> below(const Eigen::Vector3d& place, ObjectId except) const;

 private:
  struct Stand {
    ObjectId id;            ///< 0: a point of the path
    Eigen::Vector2d place;  ///< horizontal, m
    double height, variance;
  };

  struct Near {
    double apart;  ///< squared distance, m²
    const Stand* stand;
  };

  /// Returns the `most` nearest of `stands` within ground.reach_m of `here`, nearest first, without
  /// `except`.
  ScratchVector<Near> around(const std::vector<Stand>& stands, const Eigen::Vector2d& here,
                             ObjectId except, std::size_t most) const;
  Eigen::Vector2d horizontal(const Eigen::Vector3d& p) const { return axes_ * p; }

  GroundParameters parameters_;
  double ratio_;
  Eigen::Matrix<double, 2, 3> axes_;
  Eigen::Vector3d up_;
  /// The points of the path share the error of the body's height.
  std::vector<Stand> stands_, path_;
};

/// Returns the height of the underside of a cuboid along `up`, m.
double underside(const State& x, const Eigen::Vector3d& up);

}  // namespace perdure::semantic_filter
