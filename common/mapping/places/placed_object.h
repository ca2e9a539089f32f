// A static object in a level frame, and the estimation of the body's pose from objects of known
// identity. Derivation: tools/docs/maths/constellation.md.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "common/base/ids.h"
#include "common/mapping/frames/level_pose.h"

namespace perdure::mapping {

/// Probability of a class; the caller assigns numbers to class names.
struct ClassShare {
  std::uint32_t name = 0;
  double probability = 0.0;
};

/// Wraps an angle, in radians, modulo 180° into (-90°, 90°].
double wrapHalfTurn(double angle);

/// A static object in a level frame.
struct PlacedObject {
  ObjectId id = 0;
  Eigen::Vector3d p = Eigen::Vector3d::Zero();               ///< centre, m
  double yaw = 0.0;                                          ///< rad, known modulo 180°
  Eigen::Matrix4d covariance = Eigen::Matrix4d::Identity();  ///< [p, yaw], m and rad
  std::vector<ClassShare> pmf;
};
/// Variance of the object's position in the plane, m²: the mean of the variances of x and y.
double planeVariance(const PlacedObject& object);

/// Transforms an object from frame B to frame A, without the error of the transform.
PlacedObject transformed(const LevelPose& T_AB, PlacedObject object);
/// Transforms an object from frame B to frame A, including the error of T_AB.
PlacedObject laid(const LevelGaussian& T_AB, const PlacedObject& object);

/// Normal equations of the step from the linearisation point x to T_MB.
struct MatchEquations {
  Eigen::Matrix4d information = Eigen::Matrix4d::Zero();
  Eigen::Vector4d pull = Eigen::Vector4d::Zero();
  double chi2 = 0.0, weights = 0.0;

  /// Adds the pair `seen` (in B) and `known` (in M). x is T_MB at the linearisation point. `blur`
  /// (m) increases the standard deviation of the position.
  void add(const PlacedObject& seen, const PlacedObject& known, const LevelPose& x,
           double weight = 1.0, double blur = 0.0);
  Eigen::Vector4d step() const;
  /// Returns the step with a prior, because some directions may be unobservable. `to_prior` is the
  /// mean of the prior minus x. A tenth of the prior's information is used, so that it has little
  /// effect in observable directions.
  Eigen::Vector4d stepNear(const Eigen::Matrix4d& prior_information,
                           const Eigen::Vector4d& to_prior) const;
  /// The covariance of T_MB, widened if the residuals exceed the assumed errors.
  Eigen::Matrix4d covariance() const;
};

}  // namespace perdure::mapping
