// Odometry from poses that are given, as the services would get it from vio.
#pragma once

#include <optional>

#include "common/replay/files/pose_file.h"
#include "common/types/odometry.h"
#include "common/types/sensors.h"

namespace perdure::tools {

/// What is declared of poses that do not say how good they are.
struct PoseAccuracy {
  double sigma_rotation = 2e-3, sigma_position = 0.02, sigma_velocity = 0.2;
  /// The error neither grows nor is forgotten from frame to frame (truth). Otherwise no increment
  /// is given and the filter lets the error walk.
  bool bounded = false;
  /// W's z axis is against gravity. Otherwise `up_W` is the mean of the body's z axis over the
  /// poses so far: a vehicle stands upright on average.
  bool z_up = false;
};
/// Of a pose file: 2 mrad, 2 cm, 0.2 m/s.
inline PoseAccuracy ofPoseFile() { return {}; }
/// Of truth that was measured (EuRoC's motion capture, KITTI's OXTS): the same, but bounded.
inline PoseAccuracy ofMeasuredTruth() { return {.bounded = true, .z_up = true}; }
/// Of a simulated folder's states, which are exact. Not zero: covariances are inverted.
inline PoseAccuracy ofExactTruth() {
  return {.sigma_rotation = 1e-5,
          .sigma_position = 1e-4,
          .sigma_velocity = 1e-3,
          .bounded = true,
          .z_up = true};
}

/// W is the poses' frame, never re-levelled; velocity comes from the pose before.
class PoseOdometry {
 public:
  PoseOdometry(replay::PoseFile poses, InstanceId instance, const WorldId& session,
               PoseAccuracy accuracy = {});
  /// Nothing where there is no pose for the frame. Frames come in order.
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
