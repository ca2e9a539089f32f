// What Perdure sees and believes, as ROS' detections, markers, poses and diagnostics.
#pragma once

#include <optional>

#include "common/ros/messages.h"
#include "common/types/detections.h"
#include "common/types/health.h"
#include "common/types/objects.h"
#include "common/types/odometry.h"

namespace perdure::ros {

/// Confirmed objects in `odom`. Each class that is possible is a result: its score is existence ×
/// its probability, its pose and covariance those of its own Gaussian. The box is that of the most
/// probable class.
Detection3DArray detections3dOf(const Objects& objects);
/// What a network found in an image of `camera`, with the classes of its model (their numbers where
/// that is not known). A score is the probability against clutter and the other classes; those
/// under 1 % are left out. Answers to predictions are none.
Detection2DArray detections2dOf(const Detections& detections, const ModelInfo* model);
/// Begins with the removal of all that was before. Solid where it is in sight, edges alone where it
/// is not, dashed where something hides it. Name spaces are the classes.
MarkerArray markersOf(const Objects& objects);
/// `gyro`: the newest rate of turn, for the twist; else its angular part has a huge covariance.
Odometry odometryOf(const perdure::Odometry& odometry, const std::optional<Eigen::Vector3d>& gyro);
/// x, y, z and σ (the name that viewers look for is `intensity`) of each, in `odom`.
PointCloud2 cloudOf(const Landmarks& landmarks);
DiagnosticStatus statusOf(const Health& health);

}  // namespace perdure::ros
