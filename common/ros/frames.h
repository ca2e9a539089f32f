// The frames of REP-105 and REP-103 in Perdure: map (M of the map store) → odom (W of the odometry)
// → base_link (the body, which is the IMU) → <camera>_link → <camera>_optical.
#pragma once

#include <array>
#include <string>

#include "common/math/rigid_transform.h"
#include "common/ros/messages.h"
#include "common/types/objects.h"
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
/// Variance of unknown values; ROS filters ignore such values.
inline constexpr double kUnknownVariance = 1e6;
using Matrix6 = Eigen::Matrix<double, 6, 6, Eigen::RowMajor>;
std::array<double, 36> numbersOf(const Matrix6& matrix);
/// Pose covariance from an object's centre and yaw about the vertical, rotated by R.
std::array<double, 36> poseCovarianceOf(const ClassBelief& belief, const Eigen::Vector3d& up,
                                        const Eigen::Matrix3d& R = Eigen::Matrix3d::Identity());
/// `T` is T_parent_child, the pose of the child in the parent.
TransformStamped transformOf(TimePoint time, const std::string& parent, const std::string& child,
                             const RigidTransform& T);

/// The transforms map → odom and odom → base_link.
TFMessage movingFrames(TimePoint time, const RigidTransform& T_MW, const RigidTransform& T_WB);
/// The transforms base_link → imu_link, and for each camera base_link → link → optical.
TFMessage fixedFrames(const Calibration& calibration);

}  // namespace perdure::ros
