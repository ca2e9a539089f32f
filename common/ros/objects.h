// Converts Perdure's detections and objects to ROS detections, markers, poses and diagnostics.
#pragma once

#include <optional>

#include "common/ros/messages.h"
#include "common/types/detections.h"
#include "common/types/health.h"
#include "common/types/objects.h"
#include "common/types/odometry.h"

namespace perdure::ros {

/// Confirmed objects in `odom`. Each possible class is a result. Its score is the product of
/// existence and class probability; its pose and covariance are those of the class's own Gaussian.
/// The box is that of the most probable class.
Detection3DArray detections3dOf(const Objects& objects);
/// Detections of a network in an image of one camera, with the class names of its model, or class
/// numbers if the model is not known. A score is the probability against clutter and the other
/// classes; scores under 1 % are left out. Answers to predictions are excluded.
Detection2DArray detections2dOf(const Detections& detections, const ModelInfo* model);
/// Markers of the confirmed objects. The first one deletes all earlier markers. Visible objects
/// are solid, others have edges only; the edges of occluded objects are dashed. Namespaces are the
/// classes.
MarkerArray markersOf(const Objects& objects);
/// The angular rate is that of `imu`, the latest sample. Its variance is that of the gyroscope's
/// noise, because the bias adds little; it is kUnknownVariance if the noise or the sample is not
/// known.
Odometry odometryOf(const perdure::Odometry& odometry, const std::optional<Imu>& imu);
/// x, y, z and σ of each landmark in `odom`. The field of σ has the name `intensity`, which viewers
/// expect.
PointCloud2 cloudOf(const Landmarks& landmarks);
/// Points in `odom` on the sides of the confirmed objects' boxes, occluded ones and those out of
/// view as well: at most 0.1 m apart horizontally, 0.25 m vertically. `intensity` is the existence.
PointCloud2 obstaclesOf(const Objects& objects);
DiagnosticStatus statusOf(const Health& health);

}  // namespace perdure::ros
