// Where one level frame lies in another, by yaw and position, from objects that are known in both,
// and what that makes of a belief. Derivation: tools/docs/maths/map_alignment.md.
#pragma once

#include <Eigen/Core>
#include <utility>
#include <vector>

#include "common/mapping/frames/laid_belief.h"
#include "services/semantic_filter/core/belief/track.h"

namespace perdure::semantic_filter {

/// An object at rest.
struct PlacedThing {
  ObjectId id = 0;
  Eigen::Vector3d p = Eigen::Vector3d::Zero();               ///< centre, m
  double yaw = 0.0;                                          ///< rad, modulo 180°
  Eigen::Matrix4d covariance = Eigen::Matrix4d::Identity();  ///< of [p, yaw], m and rad
  std::vector<ClassNumber> pmf;
};
PlacedThing placedOf(const ObjectBelief& belief);

/// x_W = R_z(yaw) x_M + p: the inverse of T_MW.
struct FrameAlignment {
  double yaw = 0.0;  ///< rad
  Eigen::Vector3d p = Eigen::Vector3d::Zero();
  Eigen::Vector3d about_M = Eigen::Vector3d::Zero();  ///< point of M that the covariance refers to
  /// Of [p_W of about_M, yaw], m and rad.
  Eigen::Matrix4d covariance = Eigen::Matrix4d::Zero();
  double nats = 0.0;       ///< log-likelihood ratio against objects placed by chance
  double next_nats = 0.0;  ///< the same for the best other alignment
  std::vector<std::pair<ObjectId, ObjectId>> pairs;  ///< of map and view, surely one object

  Eigen::Vector3d operator*(const Eigen::Vector3d& p_M) const;
};

/// [p_W of a point of M, yaw], the quantity that the fit estimates.
using LevelPose = Eigen::Vector4d;
/// `about_M` is that point of M.
FrameAlignment alignmentAt(const LevelPose& x, const Eigen::Vector3d& about_M);
/// Wraps modulo 180° into (-90°, 90°].
double wrapHalfTurn(double angle);

/// Normal equations of a LevelPose from objects of known identity.
struct AlignmentEquations {
  Eigen::Matrix4d information = Eigen::Matrix4d::Zero();
  Eigen::Vector4d pull = Eigen::Vector4d::Zero();
  double chi2 = 0.0, weights = 0.0;

  /// `blur` (m) is added to the deviation of the object's place.
  void add(const PlacedThing& seen, const PlacedThing& thing, const Eigen::Vector3d& about_M,
           const LevelPose& x, double weight = 1.0, double blur = 0.0);
  LevelPose step() const;
  /// Is widened where errors are larger than assumed.
  Eigen::Matrix4d covariance() const;
};

/// Returns the alignment from objects of known identity in both frames, or `start` if there are
/// fewer than three. Each pair is an object in M and in W.
FrameAlignment refined(const FrameAlignment& start,
                       const std::vector<std::pair<PlacedThing, PlacedThing>>& pairs);

using mapping::turned;

/// Transforms a belief into W. Its covariance includes the error of the alignment. Its
/// cross-covariance with the pose error is unknown and set to zero.
ObjectBelief laidInto(const FrameAlignment& alignment, ObjectBelief belief);

}  // namespace perdure::semantic_filter
