#include "services/semantic_filter/core/belief/view_change.h"

#include <algorithm>
#include <cmath>

namespace perdure::semantic_filter {

ViewRay viewRayOf(const Eigen::Vector3d& position, const RigidTransform& T_WC) {
  const Eigen::Vector3d ray = position - T_WC.p;
  const double distance = std::max(ray.norm(), 1e-3);
  const Eigen::Vector3d ray_W = ray / distance;
  return {ray_W, T_WC.q.conjugate() * ray_W, std::log(distance)};
}

double viewChange(const ViewRay& a, const ViewRay& b, const ViewScales& scales) {
  return (a.ray_W - b.ray_W).norm() / scales.angle +
         (a.ray_C - b.ray_C).norm() / scales.image_angle +
         std::abs(a.log_distance - b.log_distance) / scales.log_distance;
}

double viewCorrelation(const ViewRay& a, const ViewRay& b, const ViewScales& scales) {
  return std::exp(-viewChange(a, b, scales));
}

double viewCorrelation(const Eigen::Vector3d& position, const RigidTransform& a,
                       const RigidTransform& b, const ViewScales& scales) {
  return viewCorrelation(viewRayOf(position, a), viewRayOf(position, b), scales);
}

}  // namespace perdure::semantic_filter
