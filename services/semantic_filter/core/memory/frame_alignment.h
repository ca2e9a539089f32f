// How one level frame of reference lies in another, by yaw and position: from things that are known
// in both, and what it makes of a belief.
#pragma once

#include <Eigen/Core>
#include <utility>
#include <vector>

#include "services/semantic_filter/core/belief/track.h"

namespace perdure::semantic_filter {

/// A thing at rest.
struct PlacedThing {
  ObjectId id = 0;
  Eigen::Vector3d p = Eigen::Vector3d::Zero();               ///< m, of its centre
  double yaw = 0.0;                                          ///< rad, modulo 180°
  Eigen::Matrix4d covariance = Eigen::Matrix4d::Identity();  ///< of [p, yaw]
  std::vector<ClassNumber> pmf;
};
PlacedThing placedOf(const ObjectBelief& belief);

/// x_W = R_z(yaw) x_M + p: the inverse of T_MW.
struct FrameAlignment {
  double yaw = 0.0;  ///< rad
  Eigen::Vector3d p = Eigen::Vector3d::Zero();
  Eigen::Vector3d about_M = Eigen::Vector3d::Zero();  ///< that the covariance refers to
  /// Of [p_W of about_M, yaw].
  Eigen::Matrix4d covariance = Eigen::Matrix4d::Zero();
  double nats = 0.0;       ///< log-likelihood ratio against things strewn like those of the map
  double next_nats = 0.0;  ///< the same of the best other way
  std::vector<std::pair<ObjectId, ObjectId>> pairs;  ///< remembered and seen, surely one thing

  Eigen::Vector3d operator*(const Eigen::Vector3d& p_M) const;
};

/// [p_W of a point of M, yaw]: where the fit of an alignment is at.
using LevelPose = Eigen::Vector4d;
/// `about_M` is that point.
FrameAlignment alignmentAt(const LevelPose& x, const Eigen::Vector3d& about_M);
/// Modulo 180°, into (-90°, 90°].
double wrapHalfTurn(double angle);

/// Normal equations of a LevelPose from things of known identity.
struct AlignmentEquations {
  Eigen::Matrix4d information = Eigen::Matrix4d::Zero();
  Eigen::Vector4d pull = Eigen::Vector4d::Zero();
  double chi2 = 0.0, weights = 0.0;

  /// `blur` (m) is added to the deviation of the thing's place.
  void add(const PlacedThing& seen, const PlacedThing& thing, const Eigen::Vector3d& about_M,
           const LevelPose& x, double weight = 1.0, double blur = 0.0);
  LevelPose step() const;
  /// Errors that are larger than was said make the result as much less sure.
  Eigen::Matrix4d covariance() const;
};

/// The alignment after things of known identity were seen in both frames; `start` where there are
/// too few. Each pair is the thing in M and in W.
FrameAlignment refined(const FrameAlignment& start,
                       const std::vector<std::pair<PlacedThing, PlacedThing>>& pairs);

/// A belief of frame B in frame A, both level.
ObjectBelief turned(const RigidTransform& T_AB, ObjectBelief belief);

/// The belief in W. The alignment's error is in its covariance; how it hangs together with the
/// error of the body's pose is not known.
ObjectBelief laidInto(const FrameAlignment& alignment, ObjectBelief belief);

}  // namespace perdure::semantic_filter
