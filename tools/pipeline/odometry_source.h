// Odometry from given poses, in the form of vio's output.
#pragma once

#include <optional>

#include "common/replay/files/pose_file.h"
#include "common/types/odometry.h"
#include "common/types/sensors.h"

namespace perdure::tools {

/// Declared accuracy of poses whose file states none; rad, m, m/s. The default is for a pose file.
struct PoseAccuracy {
  double sigma_rotation = 2e-3, sigma_position = 0.02, sigma_velocity = 0.2;
  /// True if the error neither grows nor decays from frame to frame, as for truth. If false,
  /// increments have the covariances of the file's steps; if the file has none, filter and graph
  /// assume a random walk.
  bool bounded = false;
  /// True if W's z axis is opposite to gravity. If false, `up_W` is the mean of the body's z axis
  /// over the poses so far, because a vehicle is upright on average.
  bool z_up = false;
};
/// Deviations (rad, m) that are added in each frame, so that increments of a body at rest have a
/// covariance. Receivers treat poses with zero covariance of the increment as exact.
inline constexpr double kLeastStepRotation = 1e-7, kLeastStepPosition = 1e-6;
/// Accuracy of measured truth (EuRoC's motion capture, KITTI's OXTS): as of a pose file, but
/// bounded.
inline PoseAccuracy ofMeasuredTruth() { return {.bounded = true, .z_up = true}; }
/// Accuracy of the exact states of a simulated folder. The values are not zero, because covariances
/// are inverted.
inline PoseAccuracy ofExactTruth() {
  return {.sigma_rotation = 1e-5,
          .sigma_position = 1e-4,
          .sigma_velocity = 1e-3,
          .bounded = true,
          .z_up = true};
}

/// Odometry from a pose file. W is the frame of the poses, whether level or not. The velocity is
/// computed from the previous pose.
class PoseOdometry {
 public:
  PoseOdometry(replay::PoseFile poses, InstanceId instance, const WorldId& session,
               PoseAccuracy accuracy = {});
  /// Returns nothing if there is no pose for the frame. Frames must come in order.
  std::optional<Odometry> at(const FrameStamp& stamp);

 private:
  void addIncrement(Odometry& odometry) const;

  replay::PoseFile poses_;
  InstanceId instance_;
  WorldId session_;
  PoseAccuracy accuracy_;
  Eigen::Vector3d up_sum_ = Eigen::Vector3d::Zero();
  std::optional<Odometry> last_;
};

}  // namespace perdure::tools
