// An object at rest in a level frame, and where the body is by objects of known identity.
// Derivation: tools/docs/maths/constellation.md.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "common/base/ids.h"
#include "common/mapping/frames/level_pose.h"

namespace perdure::mapping {

/// Probability of a class, by a number that the caller gives to its name.
struct ClassShare {
  std::uint32_t name = 0;
  double probability = 0.0;
};

/// Wraps modulo 180° into (-90°, 90°].
double wrapHalfTurn(double angle);

/// An object at rest in some level frame.
struct PlacedObject {
  ObjectId id = 0;
  Eigen::Vector3d p = Eigen::Vector3d::Zero();               ///< centre, m
  double yaw = 0.0;                                          ///< rad, known modulo 180°
  Eigen::Matrix4d covariance = Eigen::Matrix4d::Identity();  ///< of [p, yaw], m and rad
  std::vector<ClassShare> pmf;
};
/// Of its place, m², the mean of x and y.
double planeVariance(const PlacedObject& object);

/// The object of frame B in frame A. The transform's own error is not added.
PlacedObject transformed(const LevelPose& T_AB, PlacedObject object);
/// The object of frame B in frame A, with the error of T_AB.
PlacedObject laid(const LevelGaussian& T_AB, const PlacedObject& object);

/// Normal equations of T_MB from objects of known identity.
struct MatchEquations {
  Eigen::Matrix4d information = Eigen::Matrix4d::Zero();
  Eigen::Vector4d pull = Eigen::Vector4d::Zero();
  double chi2 = 0.0, weights = 0.0;

  /// `seen` in B, `known` in M; x: T_MB at which it is linear. `blur` (m) is added to the
  /// deviation of the place.
  void add(const PlacedObject& seen, const PlacedObject& known, const LevelPose& x,
           double weight = 1.0, double blur = 0.0);
  Eigen::Vector4d step() const;
  /// The same where some directions may not be seen at all: these go by a prior, whose mean lies
  /// `to_prior` from x. It counts by a tenth of its information, so that it pulls at nothing else.
  Eigen::Vector4d stepNear(const Eigen::Matrix4d& prior_information,
                           const Eigen::Vector4d& to_prior) const;
  /// Is widened where errors are larger than assumed.
  Eigen::Matrix4d covariance() const;
};

}  // namespace perdure::mapping
