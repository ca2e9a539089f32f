// From where a point is looked at, and how much that changes.
#pragma once

#include <Eigen/Core>

#include "common/math/rigid_transform.h"

namespace perdure::semantic_filter {

/// How much the view of a point changed from camera pose a to b, in lengths after which what two
/// looks have in common has fallen to 1/e.
struct ViewScales {
  double angle, log_distance, image_angle;
};
/// Of a point from one camera pose.
struct ViewRay {
  Eigen::Vector3d ray_W, ray_C;  ///< unit, from the camera to it
  double log_distance;
};
ViewRay viewRayOf(const Eigen::Vector3d& position, const RigidTransform& T_WC);
double viewChange(const ViewRay& a, const ViewRay& b, const ViewScales& scales);
double viewChange(const Eigen::Vector3d& position, const RigidTransform& T_WC_a,
                  const RigidTransform& T_WC_b, const ViewScales& scales);

}  // namespace perdure::semantic_filter
