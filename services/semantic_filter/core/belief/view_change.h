// View change: how much the viewpoint of a point has changed, in correlation lengths. Derivation:
// tools/docs/maths/class_and_existence_update.md.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "common/math/rigid_transform.h"

namespace perdure::semantic_filter {

/// Correlation lengths: after such a change, the correlation of two observations has fallen to 1/e.
/// Radians of direction, log distance, radians in the image.
struct ViewScales {
  double angle, log_distance, image_angle;
};
/// Direction and distance of a point from one camera pose.
struct ViewRay {
  Eigen::Vector3d ray_W, ray_C;  ///< unit vectors from the camera to the point
  double log_distance;
};
inline ViewRay viewRayOf(const Eigen::Vector3d& position, const RigidTransform& T_WC) {
  const Eigen::Vector3d ray = position - T_WC.p;
  const double distance = std::max(ray.norm(), 1e-3);
  const Eigen::Vector3d ray_W = ray / distance;
  return {ray_W, T_WC.q.conjugate() * ray_W, std::log(distance)};
}

inline double viewChange(const ViewRay& a, const ViewRay& b, const ViewScales& scales) {
  return (a.ray_W - b.ray_W).norm() / scales.angle +
         (a.ray_C - b.ray_C).norm() / scales.image_angle +
         std::abs(a.log_distance - b.log_distance) / scales.log_distance;
}

/// Returns the correlation of two observations from these views, 0 to 1.
inline double viewCorrelation(const ViewRay& a, const ViewRay& b, const ViewScales& scales) {
  return std::exp(-viewChange(a, b, scales));
}

inline double viewCorrelation(const Eigen::Vector3d& position, const RigidTransform& a,
                              const RigidTransform& b, const ViewScales& scales) {
  return viewCorrelation(viewRayOf(position, a), viewRayOf(position, b), scales);
}

}  // namespace perdure::semantic_filter
