#include "common/camera/ground_view.h"

#include <cmath>

namespace perdure {

bool looksAlongGround(const CameraModel& camera) {
  return std::abs(camera.T_BC().R()(2, 2)) < std::sin(M_PI / 3.0);
}

void forGroundInView(const CameraModel& camera, const RigidTransform& T_GB, const GroundGrid& grid,
                     const std::function<void(int, int)>& visit) {
  const RigidTransform T_CG = (T_GB * camera.T_BC()).inverse();
  const auto indexOf = [&](double metres) {
    return static_cast<int>(std::floor(metres / grid.cell_m));
  };
  const auto centreOf = [&](int index) { return (index + 0.5) * grid.cell_m; };
  const Eigen::Vector2d body = T_GB.p.head<2>();
  for (int i = indexOf(body.x() - grid.reach_m); i <= indexOf(body.x() + grid.reach_m); ++i) {
    for (int j = indexOf(body.y() - grid.reach_m); j <= indexOf(body.y() + grid.reach_m); ++j) {
      const Eigen::Vector2d centre(centreOf(i), centreOf(j));
      if ((centre - body).norm() > grid.reach_m) continue;
      const auto pixel =
          camera.project(T_CG * Eigen::Vector3d(centre.x(), centre.y(), grid.height_m));
      if (pixel && camera.inImage(*pixel)) visit(i, j);
    }
  }
}

}  // namespace perdure
