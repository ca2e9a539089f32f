// A start in motion from images and inertial samples alone, with one or two cameras: the gyro bias
// from the coplanarity of epipolar normals (Kneip & Lynen, ICCV 2013; He et al., CVPR 2023), then
// velocity and gravity linearly with the points eliminated (Dong-Si & Mourikis, IROS 2012), the
// length of gravity being known; then all of it together (motion_refinement.h).
#pragma once

#include <deque>
#include <optional>
#include <vector>

#include "services/vio/core/estimator.h"
#include "services/vio/core/propagation/imu_propagator.h"

namespace perdure::vio {

class MotionInitialiser {
 public:
  explicit MotionInitialiser(const Options& options) : options_(options) {}

  void add(const FrameInput& input, TimePoint imu_time);
  void clear() { frames_.clear(), failed_.reset(); }
  /// A start at the newest frame, where the window has grown enough since the last search. Fails
  /// with "start_window_short", "start_few_tracks", "start_no_parallax", "start_unobservable" or
  /// "start_inconsistent".
  Result<Start> start(const ImuBuffer& imu, const std::vector<CameraModel>& cameras);

 private:
  struct Seen {
    TimePoint time;  ///< IMU clock
    TrackedFrame tracked;
  };
  Result<Start> attempt(const ImuBuffer& imu, const std::vector<CameraModel>& cameras) const;

  Options options_;
  std::deque<Seen> frames_;
  std::optional<Reason> failed_;  ///< why the last search gave nothing
  TimePoint next_attempt_{};
};

/// The argmin of ½ gᵀ M g − dᵀ g with |g| = length; M symmetric, positive semidefinite.
Eigen::Vector3d solveOnSphere(const Eigen::Matrix3d& M, const Eigen::Vector3d& d, double length);

/// Matches between two times, as bearings of one camera, and the increment between them.
struct BearingPair {
  std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>> bearings;  ///< in C, unit
  Eigen::Matrix3d R_B0_B1;                                            ///< at bias zero
  Eigen::Matrix3d J_bias;  ///< right tangent of R_B0_B1 by the gyro bias
};
/// The gyro bias that makes each pair's epipolar normals most nearly coplanar.
Eigen::Vector3d gyroBiasFromPairs(const std::vector<BearingPair>& pairs,
                                  const Eigen::Matrix3d& R_BC);

}  // namespace perdure::vio
