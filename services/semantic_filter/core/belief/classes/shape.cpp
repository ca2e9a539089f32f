#include "services/semantic_filter/core/belief/classes/shape.h"

#include "common/base/check.h"

namespace perdure::semantic_filter {
namespace {

struct Corner {
  Eigen::Vector3d place;
  double forward = 0.0;
};

Shape shapeOf(const std::vector<Corner>& corners) {
  const auto n = static_cast<Eigen::Index>(corners.size());
  check(n <= Shape::kMostCorners, "a shape has at most kMostCorners corners");
  check(n % 4 == 0, "a level has four corners or eight");
  Shape shape;
  for (auto* axis : {&shape.along, &shape.across, &shape.up, &shape.forward}) axis->resize(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto& [place, forward] = corners[static_cast<std::size_t>(i)];
    shape.along[i] = place.x();
    shape.across[i] = place.y();
    shape.up[i] = place.z();
    shape.forward[i] = forward;
  }
  return shape;
}

Shape makeCuboid() {
  std::vector<Corner> corners;
  for (int i = 0; i < 8; ++i) {
    corners.push_back({{(i & 1) ? 1.0 : -1.0, (i & 2) ? 1.0 : -1.0, (i & 4) ? 1.0 : -1.0}});
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
  std::vector<Corner> corners;
  for (const ShapeLevel& level : levels) {
    for (const double x : {-level.along, level.along}) {
      for (const double y : {-level.across, level.across}) {
        corners.push_back({{x, level.corner * y, level.height}, level.forward});
        if (level.corner < 1.0) {
          corners.push_back({{level.corner * x, y, level.height}, level.forward});
        }
      }
    }
  }
  return shapeOf(corners);
}

}  // namespace perdure::semantic_filter
