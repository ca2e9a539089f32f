#include "common/sim/inside_image.h"

#include <algorithm>
#include <array>
#include <limits>
#include <optional>

#include "common/math/so3.h"

namespace perdure::sim {
namespace {

/// Range of one image coordinate.
struct Range {
  double least = std::numeric_limits<double>::infinity();
  double most = -std::numeric_limits<double>::infinity();

  bool empty() const { return !(least < most); }
  void include(double value) {
    least = std::min(least, value);
    most = std::max(most, value);
  }
};

/// Ranges of a cuboid's image along u and v: of all of it, and of what lies within the borders of
/// the other coordinate.
struct Ranges {
  std::array<Range, 2> all, within;
  bool before_camera = true;  ///< all corners are
};

/// Enters the points on a line between two corners: each, and those where it crosses a border.
void includeLine(Ranges& ranges, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                 const CameraModel& camera) {
  constexpr int kSteps = 16;
  const double extent[2] = {double(camera.width()), double(camera.height())};
  std::optional<Eigen::Vector2d> before;
  for (int i = 0; i <= kSteps; ++i) {
    const auto pixel = camera.project(a + (double(i) / kSteps) * (b - a));
    for (int axis = 0; pixel && axis < 2; ++axis) {
      const double across = (*pixel)[axis], along = (*pixel)[1 - axis];
      ranges.all[1 - axis].include(along);
      if (across >= 0.0 && across <= extent[axis]) ranges.within[1 - axis].include(along);
      for (const double border : {0.0, extent[axis]}) {
        if (!before || ((*before)[axis] < border) == (across < border)) continue;
        const double s = (border - (*before)[axis]) / (across - (*before)[axis]);
        ranges.within[1 - axis].include((*before)[1 - axis] + s * (along - (*before)[1 - axis]));
      }
    }
    before = pixel;
  }
}

Ranges rangesOf(const TruthObject& object, const TruthKey& at, const RigidTransform& T_CW,
                const CameraModel& camera) {
  std::array<Eigen::Vector3d, 8> corners;
  for (int i = 0; i < 8; ++i) {
    const Eigen::Vector3d half(i & 1 ? 0.5 : -0.5, i & 2 ? 0.5 : -0.5, i & 4 ? 0.5 : -0.5);
    corners[i] = T_CW * (at.centre_W + rotationAboutZ(at.yaw) * half.cwiseProduct(object.size));
  }
  Ranges ranges;
  for (int i = 0; i < 8; ++i) {
    ranges.before_camera = ranges.before_camera && camera.project(corners[i]);
    for (int j = 0; j < i; ++j) includeLine(ranges, corners[i], corners[j], camera);
  }
  return ranges;
}

}  // namespace

Box partInsideImage(const TruthView& view, const TruthObject& object, const TruthKey& at,
                    const RigidTransform& T_CW, const CameraModel& camera) {
  const double w = camera.width(), h = camera.height();
  Box box = view.box;
  const bool cut = box.x1 < 0.0 || box.y1 < 0.0 || box.x2 > w || box.y2 > h;
  if (cut) {
    const Ranges ranges = rangesOf(object, at, T_CW, camera);
    double* const sides[2][2] = {{&box.x1, &box.x2}, {&box.y1, &box.y2}};
    for (int axis = 0; axis < 2; ++axis) {
      const Range &all = ranges.all[axis], &within = ranges.within[axis];
      if (all.empty() || within.empty()) continue;
      const double low = ranges.before_camera ? *sides[axis][0] : all.least;
      const double high = ranges.before_camera ? *sides[axis][1] : all.most;
      const double scale = (high - low) / (all.most - all.least);
      *sides[axis][0] = low + scale * (within.least - all.least);
      *sides[axis][1] = low + scale * (within.most - all.least);
    }
  }
  return {std::clamp(box.x1, 0.0, w), std::clamp(box.y1, 0.0, h), std::clamp(box.x2, 0.0, w),
          std::clamp(box.y2, 0.0, h)};
}

}  // namespace perdure::sim
