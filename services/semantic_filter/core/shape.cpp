#include "services/semantic_filter/core/shape.h"

namespace perdure::semantic_filter {
namespace {

Shape makeCuboid() {
  Shape shape;
  shape.is_cuboid = true;
  for (int i = 0; i < 8; ++i) {
    shape.points.push_back({(i & 1) ? 1.0 : -1.0, (i & 2) ? 1.0 : -1.0, (i & 4) ? 1.0 : -1.0});
  }
  return shape;
}

}  // namespace

const Shape& cuboidShape() {
  static const Shape cuboid = makeCuboid();
  return cuboid;
}

Shape shapeOf(const std::vector<ShapeLevel>& levels) {
  Shape shape;
  for (const ShapeLevel& level : levels) {
    for (const double x : {-level.along, level.along}) {
      for (const double y : {-level.across, level.across}) {
        shape.points.push_back({x, level.corner * y, level.height});
        if (level.corner < 1.0) shape.points.push_back({level.corner * x, y, level.height});
      }
    }
  }
  return shape;
}

}  // namespace perdure::semantic_filter
