#include "services/gateway/core/cuboid.h"

#include <cmath>

#include "common/math/so3.h"

namespace perdure::gateway {

Cuboid cuboidOf(const ObjectBelief& object, const Eigen::Vector3d& up_W) {
  const Vector7d& x = object.best().mean;
  const Eigen::Quaterniond level = levelling(up_W).conjugate();
  const Eigen::Quaterniond yaw(Eigen::AngleAxisd(x[3], Eigen::Vector3d::UnitZ()));
  return {RigidTransform(Eigen::Quaterniond(level * yaw), Eigen::Vector3d(x.head<3>())),
          x.tail<3>().array().exp().matrix()};
}

std::array<Eigen::Vector3d, 8> cornersOf(const Cuboid& cuboid) {
  std::array<Eigen::Vector3d, 8> corners;
  for (unsigned i = 0; i < 8; ++i) {
    const Eigen::Vector3d side((i & 1U) != 0 ? 0.5 : -0.5, (i & 2U) != 0 ? 0.5 : -0.5,
                               (i & 4U) != 0 ? 0.5 : -0.5);
    corners[i] = cuboid.T_WO * side.cwiseProduct(cuboid.size);
  }
  return corners;
}

std::string nameOf(const ObjectBelief& object) {
  return object.best().name + " " + std::to_string(object.id);
}

}  // namespace perdure::gateway
