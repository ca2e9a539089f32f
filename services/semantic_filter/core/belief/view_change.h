// View change: how much the viewpoint of a point has changed, in correlation lengths. Derivation:
// tools/docs/maths/class_and_existence_update.md.
#pragma once

#include <Eigen/Core>

#include "common/math/rigid_transform.h"

namespace perdure::semantic_filter {

/// Correlation lengths: after such a change, the correlation of two observations has fallen to 1/e.
/// Radians of direction, log distance, radians in the image.
struct ViewScales {
  double angle, log_distance, image_angle;
};
/// A point as one camera pose sees it.
struct ViewRay {
  Eigen::Vector3d ray_W, ray_C;  ///< unit vectors from the camera to the point
  double log_distance;
};
ViewRay viewRayOf(const Eigen::Vector3d& position, const RigidTransform& T_WC);
double viewChange(const ViewRay& a, const ViewRay& b, const ViewScales& scales);
/// Returns the correlation of two observations from these views, 0 to 1.
double viewCorrelation(const ViewRay& a, const ViewRay& b, const ViewScales& scales);
double viewCorrelation(const Eigen::Vector3d& position, const RigidTransform& T_WC_a,
                       const RigidTransform& T_WC_b, const ViewScales& scales);

}  // namespace perdure::semantic_filter
