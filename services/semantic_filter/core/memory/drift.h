// How far odometry has wandered since the map was made: things that come back into the picture from
// an earlier visit stand where they stood, and what their boxes are off by together is the pose's
// error (DESIGN 5, item 13: T_MW within one epoch). The filter itself only considers that error
// (item 2); where it is significant it is taken out at once, in yaw and position.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "common/math/rigid_transform.h"
#include "services/semantic_filter/core/measurement/box_likelihood.h"
#include "services/semantic_filter/core/measurement/frame.h"

namespace perdure::semantic_filter {

using Vector6d = Eigen::Matrix<double, 6, 1>;

/// Of the pose's error g = [θ, p], true against said: log-likelihood pullᵀ g - ½ gᵀ information g.
struct DriftMeasurement {
  Matrix6d information = Matrix6d::Zero();
  Vector6d pull = Vector6d::Zero();
};

/// What the box of a known thing says of the pose it is seen from, given what the thing's place has
/// in common with that pose's error. `h` and `predicted` are of before the measurement. Nothing
/// where no side can be compared, or the box is an outlier.
std::optional<DriftMeasurement> driftMeasurement(const Hypothesis& h, const ProjectedBox& predicted,
                                                 const BoxMeasurement& z,
                                                 const std::array<bool, 4>& hidden,
                                                 const Matrix6d& P_pose);

/// The pose is better known from one frame on.
struct PoseCorrection {
  RigidTransform step;                ///< T_M'M: poses in M, times this from the left
  Vector6d error = Vector6d::Zero();  ///< the estimate of g that is taken out
  Matrix6d before, after;             ///< covariance of the pose's error
};

class DriftEstimator {
 public:
  explicit DriftEstimator(const DriftParameters& parameters) : parameters_(parameters) {}

  /// The body went on; its pose's error walks by so much for each metre, rad/√m and m/√m.
  void predict(const RigidTransform& from, const RigidTransform& to, double rotation_walk,
               double position_walk);
  /// KeyframeBatch at things of earlier visits, from T_MB.
  void add(const std::vector<DriftMeasurement>& measurements, const RigidTransform& T_MB);
  /// Where the error is significant and worth it: it is taken out, and no longer in here.
  std::optional<PoseCorrection> correct(const RigidTransform& T_MB, const PoseError& pose_error);

 private:
  DriftParameters parameters_;
  Eigen::Vector4d g_ = Eigen::Vector4d::Zero();  ///< [yaw about gravity, p]
  Eigen::Matrix4d P_ = Eigen::Matrix4d::Zero();
  std::size_t things_ = 0;  ///< heard since the last correction
};

/// Its place as the corrected pose has it, as far as it hangs together with that pose's error.
/// `pose_error` is of before the correction.
void applyCorrection(Track& track, const PoseCorrection& correction, const PoseError& pose_error);

}  // namespace perdure::semantic_filter
