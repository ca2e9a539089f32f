#include "common/sim/solid.h"

#include <algorithm>
#include <cmath>

#include "common/math/so3.h"

namespace perdure::sim {
namespace {

constexpr double kCrownFrom = 0.38;  ///< share of a tree's height
constexpr double kTrunkHalf = 0.2;   ///< metres

Eigen::Vector2d along(double yaw) { return {std::cos(yaw), std::sin(yaw)}; }

/// Extent of `solid` from its centre in `direction` (unit length).
double reach(const Solid& solid, const Eigen::Vector2d& direction) {
  const Eigen::Vector2d x = along(solid.yaw), y(-x.y(), x.x());
  return solid.half.x() * std::abs(x.dot(direction)) + solid.half.y() * std::abs(y.dot(direction));
}

}  // namespace

std::array<Eigen::Vector2d, 4> Solid::corners() const {
  const Eigen::Vector2d x = half.x() * along(yaw);
  const Eigen::Vector2d y = half.y() * Eigen::Vector2d(-std::sin(yaw), std::cos(yaw));
  return {centre + x + y, centre + x - y, centre - x - y, centre - x + y};
}

double gapBetween(const Solid& a, const Solid& b) {
  const Eigen::Vector2d offset = b.centre - a.centre;
  double gap = std::max(b.low - a.high, a.low - b.high);
  for (const double yaw : {a.yaw, a.yaw + M_PI_2, b.yaw, b.yaw + M_PI_2}) {
    const Eigen::Vector2d axis = along(yaw);
    gap = std::max(gap, std::abs(offset.dot(axis)) - reach(a, axis) - reach(b, axis));
  }
  return gap;
}

bool meet(const Solid& a, const Solid& b, double margin) {
  const double far = a.half.norm() + b.half.norm() + margin;
  if ((a.centre - b.centre).squaredNorm() > far * far) return false;
  return gapBetween(a, b) < margin;
}

double distanceTo(const Solid& solid, const Eigen::Vector2d& point) {
  const Eigen::Vector2d x = along(solid.yaw), y(-x.y(), x.x()), offset = point - solid.centre;
  const Eigen::Vector2d outside(std::max(0.0, std::abs(offset.dot(x)) - solid.half.x()),
                                std::max(0.0, std::abs(offset.dot(y)) - solid.half.y()));
  return outside.norm();
}

bool blocks(const Solid& solid, const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  const Eigen::Vector2d x = along(solid.yaw), y(-x.y(), x.x());
  const auto local = [&](const Eigen::Vector3d& p) {
    const Eigen::Vector2d offset = p.head<2>() - solid.centre;
    return Eigen::Vector3d(offset.dot(x), offset.dot(y), p.z());
  };
  const Eigen::Vector3d low(-solid.half.x(), -solid.half.y(), solid.low);
  const Eigen::Vector3d high(solid.half.x(), solid.half.y(), solid.high);
  const Eigen::Vector3d start = local(from), way = local(to) - start;
  double enters = 0.0, leaves = 1.0;
  for (Eigen::Index i = 0; i < 3; ++i) {
    if (std::abs(way[i]) < 1e-12) {
      if (start[i] <= low[i] || start[i] >= high[i]) return false;
      continue;
    }
    const double a = (low[i] - start[i]) / way[i], b = (high[i] - start[i]) / way[i];
    enters = std::max(enters, std::min(a, b));
    leaves = std::min(leaves, std::max(a, b));
  }
  return enters < leaves;
}

Solid solidOf(const SceneObject& object, double t_s) {
  const RigidTransform T_WO = object.motion.poseAt(t_s);
  return {T_WO.p.head<2>(), yawOf(T_WO.R()), 0.5 * object.size.head<2>(),
          T_WO.p.z() - 0.5 * object.size.z(), T_WO.p.z() + 0.5 * object.size.z()};
}

std::vector<Solid> solidsOf(const Prop& prop) {
  Solid box{prop.T_WP.p.head<2>(), yawOf(prop.T_WP.R()), 0.5 * prop.size.head<2>(),
            prop.T_WP.p.z() - 0.5 * prop.size.z(), prop.T_WP.p.z() + 0.5 * prop.size.z()};
  if (prop.kind != PropKind::kTree) return {box};
  Solid trunk = box, crown = box;
  trunk.half = trunk.half.cwiseMin(kTrunkHalf);
  crown.low = trunk.high = box.low + kCrownFrom * prop.size.z();
  return {trunk, crown};
}

}  // namespace perdure::sim
