// Map-relative drift T_MW: the error of odometry that returning objects show (ours; the consider
// filter is Schmidt 1966). Derivation: tools/docs/maths/map_relative_drift.md.
//
// An object that returns from an earlier visit stands where it stood. What the boxes of such
// objects are off by together is the pose error. The filter only considers that error; here it is
// estimated in yaw and position. It is removed at once where it is significant.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "common/math/rigid_transform.h"
#include "services/semantic_filter/core/measurement/box_likelihood.h"
#include "services/semantic_filter/core/measurement/frame.h"

namespace perdure::semantic_filter {

using Vector6d = Eigen::Matrix<double, 6, 1>;

/// Log-likelihood of the pose error g = [θ, p], true minus assumed: pullᵀ g - ½ gᵀ information g.
struct DriftMeasurement {
  Matrix6d information = Matrix6d::Zero();
  Vector6d pull = Vector6d::Zero();
};

/// Returns what the box of a known object says of the pose error, given what the object's place
/// shares with that error. `h` and `predicted` are from before the update. Returns nothing if no
/// side can be compared, or if the box is an outlier.
std::optional<DriftMeasurement> driftMeasurement(const Hypothesis& h, const ProjectedBox& predicted,
                                                 const BoxMeasurement& z,
                                                 const std::array<bool, 4>& hidden,
                                                 const Matrix6d& P_pose);

/// A correction of the pose from one frame on.
struct PoseCorrection {
  RigidTransform step;                ///< T_M'M: multiplies poses in M from the left
  Vector6d error = Vector6d::Zero();  ///< the estimate of g that is removed
  Matrix6d before, after;             ///< covariances of the pose error
};

class DriftEstimator {
 public:
  explicit DriftEstimator(const DriftParameters& parameters) : parameters_(parameters) {}

  /// The body moved; the pose error walks by rad/√m and m/√m.
  void predict(const RigidTransform& from, const RigidTransform& to, double rotation_walk,
               double position_walk);
  /// Adds measurements of returning objects, made from T_MB.
  void add(const std::vector<DriftMeasurement>& measurements, const RigidTransform& T_MB);
  /// Removes the error and returns it, if it is significant and large enough.
  std::optional<PoseCorrection> correct(const RigidTransform& T_MB, const PoseError& pose_error);

 private:
  DriftParameters parameters_;
  Eigen::Vector4d g_ = Eigen::Vector4d::Zero();  ///< [yaw about gravity, p]
  Eigen::Matrix4d P_ = Eigen::Matrix4d::Zero();
  std::size_t things_ = 0;  ///< number of measurements since the last correction
};

/// Moves the track to its place under the corrected pose, as far as it is correlated with the pose
/// error. `pose_error` is from before the correction.
void applyCorrection(Track& track, const PoseCorrection& correction, const PoseError& pose_error);

}  // namespace perdure::semantic_filter
