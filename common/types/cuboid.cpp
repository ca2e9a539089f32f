#include "common/types/cuboid.h"

#include <algorithm>
#include <cmath>

#include "common/math/so3.h"

namespace perdure {
namespace {

constexpr double kDash = 0.25, kGap = 0.2;  // m
constexpr int kMostDashes = 40;             // per edge

/// Adds the ends of the strokes from a to b: one stroke for a solid line, several for a dashed
/// line.
void addStrokes(const Eigen::Vector3d& a, const Eigen::Vector3d& b, bool dashed,
                std::vector<Eigen::Vector3d>& ends) {
  const double length = (b - a).norm();
  if (!dashed || length < 2 * kDash) {
    ends.push_back(a);
    ends.push_back(b);
    return;
  }
  const int strokes =
      std::clamp(static_cast<int>(std::round(length / (kDash + kGap))), 2, kMostDashes);
  // Strokes begin and end at the corners, so there is one gap less than strokes.
  const double unit = 1.0 / (strokes * (kDash + kGap) - kGap);
  for (int i = 0; i < strokes; ++i) {
    const double from = i * (kDash + kGap) * unit;
    ends.emplace_back(a + from * (b - a));
    ends.emplace_back(a + (from + kDash * unit) * (b - a));
  }
}

}  // namespace

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

std::vector<Eigen::Vector3d> strokesOf(const Cuboid& cuboid, bool dashed) {
  const auto corners = cornersOf(cuboid);
  std::vector<Eigen::Vector3d> ends;
  for (const auto& [a, b] : kEdges)
    addStrokes(corners[static_cast<std::size_t>(a)], corners[static_cast<std::size_t>(b)], dashed,
               ends);
  const Eigen::Vector3d floor = (corners[0] + corners[3]) / 2,
                        front = (corners[1] + corners[3]) / 2;
  addStrokes(floor, front, dashed, ends);
  return ends;
}

std::string nameOf(const ObjectBelief& object) {
  return object.best().name + " " + std::to_string(object.id);
}

}  // namespace perdure
