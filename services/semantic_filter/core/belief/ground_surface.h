// How high the ground is, by what stands on it: things placed by parallax tell where their
// undersides are, and what else stands near by stands about as high. A thing far ahead, of which
// size alone says how far it is, so stands where the street is; one that seems to stand below it is
// nearer, or moves. What carries the body stands on it, too: where the body's height above it is
// known, the way that it came tells of it from the first frame on.
//
// The ground is a level plane of unknown height with a slope N(0, ground.slope²) and Brownian
// unevenness, ground.roughness² a metre; nothing is known of it where nothing stands. Heights are
// along the view's up, in the frame of reference of the beliefs.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "common/base/inplace_vector.h"
#include "services/semantic_filter/core/belief/class_prior.h"
#include "services/semantic_filter/core/belief/track.h"
#include "services/semantic_filter/core/parameters.h"

namespace perdure::semantic_filter {

struct GroundHeight {
  double mean = 0.0, variance = 0.0;  ///< m, m²
  double uneven = 0.0;                ///< the part of the variance that slope and roughness make
};

/// How uneven the ground is beside what ground.slope and ground.roughness assume of it, as those
/// that stand on it say. Part of the belief.
class GroundRoughness {
 public:
  /// Of the variances, true by assumed. `assumed`: things that updateClassAndExistence as much as
  /// the assumption.
  double ratio(double assumed) const;
  /// A thing stands by `above` (m) higher than the others say. `share`: of its looks that are new.
  void learn(double above, const GroundHeight& others, double own_variance, double ratio,
             double share);

 private:
  double squares_ = 0.0, things_ = 0.0;
};

/// Where the body went lately, by places that are some metres apart. Part of the belief.
class BodyPath {
 public:
  static constexpr std::size_t kPlaces = 6;

  void go(const Eigen::Vector3d& body);

  const Eigen::Vector3d* begin() const { return places_.begin(); }
  const Eigen::Vector3d* end() const { return places_.end(); }

 private:
  InplaceVector<Eigen::Vector3d, kPlaces> places_;  ///< the newest last
};

class GroundSurface {
 public:
  /// Of all that stands surely, was seen from several sides and is of a class that does; and, where
  /// its height above the ground is known, of where the body went.
  GroundSurface(const std::vector<Track>& tracks, const BodyPath& path,
                const GroundRoughness& roughness_scale, const Eigen::Vector3d& up_W,
                const ClassPriors& priors, const GroundParameters& parameters);

  /// What the track's ground_contact says of how even it is.
  void tell(GroundRoughness& roughness_scale, const Track& track, double share) const;
  /// Below `place`, without what `except` itself says; nothing where fewer than three tell and the
  /// body's height is not known.
  std::optional<GroundHeight> below(const Eigen::Vector3d& place, ObjectId except) const;

 private:
  struct Stand {
    ObjectId id;            ///< 0: the body's
    Eigen::Vector2d place;  ///< horizontal
    double height, variance;
  };

  struct Near {
    double apart;  ///< m²
    const Stand* stand;
  };

  /// Those of `stands` within reach of a place, but for `except`; the nearest first, `most` of
  /// them.
  std::vector<Near> around(const std::vector<Stand>& stands, const Eigen::Vector2d& here,
                           ObjectId except, std::size_t most) const;
  Eigen::Vector2d horizontal(const Eigen::Vector3d& p) const { return axes_ * p; }

  GroundParameters parameters_;
  double ratio_;
  Eigen::Matrix<double, 2, 3> axes_;
  Eigen::Vector3d up_;
  std::vector<Stand> stands_, path_;  ///< those on the path have the body's height in common
};

/// Height of the underside of a cuboid, m.
double underside(const State& x, const Eigen::Vector3d& up);

}  // namespace perdure::semantic_filter
