// Odometry from a file of poses, as the services would get it from vio.
#pragma once

#include <optional>

#include "common/replay/pose_file.h"
#include "common/types/odometry.h"
#include "common/types/sensors.h"

namespace perdure::tools {

/// W is the file's frame, never re-levelled. What a file does not say is declared: no increment
/// (the filter then lets the pose error walk), a standard deviation of 2 mrad, 2 cm and 0.2 m/s,
/// `up_W` as the mean of the body's z axis over the poses so far (a vehicle stands upright on
/// average), velocity from the pose before.
class PoseOdometry {
 public:
  PoseOdometry(replay::PoseFile poses, InstanceId instance);
  /// Nothing where the file has no pose for the frame. Frames come in order.
  std::optional<Odometry> at(const FrameStamp& stamp);

 private:
  replay::PoseFile poses_;
  InstanceId instance_;
  Eigen::Vector3d up_sum_ = Eigen::Vector3d::Zero();
  std::optional<Odometry> last_;
};

}  // namespace perdure::tools
