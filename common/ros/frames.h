// The frames of REP-105 and REP-103 in Perdure: map (M of the map store) → odom (W of the odometry)
// → base_link (the body, which is the IMU) → <camera>_link → <camera>_optical.
#pragma once

#include <string>

#include "common/math/rigid_transform.h"
#include "common/ros/messages.h"
#include "common/types/sensors.h"

namespace perdure::ros {

inline constexpr char kMapFrame[] = "map", kOdomFrame[] = "odom", kBodyFrame[] = "base_link",
                      kImuFrame[] = "imu_link";
std::string linkFrame(const std::string& camera);
std::string opticalFrame(const std::string& camera);

Time rosTime(TimePoint time);
Header headerOf(TimePoint time, const std::string& frame);
Point pointOf(const Eigen::Vector3d& p);
Pose poseOf(const RigidTransform& T);
/// T_parent_child.
TransformStamped transformOf(TimePoint time, const std::string& parent, const std::string& child,
                             const RigidTransform& T);

/// map → odom and odom → base_link.
TFMessage movingFrames(TimePoint time, const RigidTransform& T_MW, const RigidTransform& T_WB);
/// base_link → imu_link, and for each camera base_link → link → optical.
TFMessage fixedFrames(const Calibration& calibration);

}  // namespace perdure::ros
