#include "services/semantic_filter/core/shape.h"

#include "common/base/check.h"

namespace perdure::semantic_filter {
namespace {

Shape shapeOf(const std::vector<Eigen::Vector3d>& corners) {
  const auto n = static_cast<Eigen::Index>(corners.size());
  check(n <= Shape::kMostCorners, "a shape has no more than so many levels");
  Shape shape;
  for (auto* axis : {&shape.along, &shape.across, &shape.up}) axis->resize(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Eigen::Vector3d& corner = corners[static_cast<std::size_t>(i)];
    shape.along[i] = corner.x();
    shape.across[i] = corner.y();
    shape.up[i] = corner.z();
  }
  return shape;
}

Shape makeCuboid() {
  std::vector<Eigen::Vector3d> corners;
  for (int i = 0; i < 8; ++i) {
    corners.emplace_back((i & 1) ? 1.0 : -1.0, (i & 2) ? 1.0 : -1.0, (i & 4) ? 1.0 : -1.0);
  }
  Shape shape = shapeOf(corners);
  shape.is_cuboid = true;
  return shape;
}

}  // namespace

const Shape& cuboidShape() {
  static const Shape cuboid = makeCuboid();
  return cuboid;
}

Shape shapeOf(const std::vector<ShapeLevel>& levels) {
  std::vector<Eigen::Vector3d> corners;
  for (const ShapeLevel& level : levels) {
    for (const double x : {-level.along, level.along}) {
      for (const double y : {-level.across, level.across}) {
        corners.emplace_back(x, level.corner * y, level.height);
        if (level.corner < 1.0) corners.emplace_back(level.corner * x, y, level.height);
      }
    }
  }
  return shapeOf(corners);
}

}  // namespace perdure::semantic_filter
