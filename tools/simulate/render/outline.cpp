#include "tools/simulate/render/outline.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

namespace perdure::tools {
namespace {

constexpr double kNearPlane = 0.05;  ///< clipping plane of triangles, metres before the camera
/// Limits of the cells along the longer side of an outline's raster, which has four per pixel.
constexpr double kMinCells = 24.0, kMaxCells = 112.0;

using Polygon = std::vector<Eigen::Vector3d>;
using Triangle = std::array<const Eigen::Vector2d*, 3>;

/// Clips a triangle at the near plane; zero, three or four corners remain.
void cutNear(const std::array<Eigen::Vector3d, 3>& triangle, Polygon& out) {
  out.clear();
  for (std::size_t i = 0; i < 3; ++i) {
    const Eigen::Vector3d &a = triangle[i], &b = triangle[(i + 1) % 3];
    if (a.z() >= kNearPlane) out.push_back(a);
    if ((a.z() >= kNearPlane) != (b.z() >= kNearPlane)) {
      out.push_back(a + (b - a) * ((kNearPlane - a.z()) / (b.z() - a.z())));
    }
  }
}

/// Marks the cells whose centre is in a drawn triangle.
class Raster {
 public:
  Raster(const Box& box, double cell)
      : x_(box.x1),
        y_(box.y1),
        cell_(cell),
        columns_(sizeOf(box.width())),
        rows_(sizeOf(box.height())),
        cells_(static_cast<std::size_t>(columns_ * rows_)) {}

  Eigen::Vector2d cellOf(const Eigen::Vector2d& pixel) const {
    return (pixel - Eigen::Vector2d(x_, y_)) / cell_;
  }
  void draw(const Triangle& p) {
    const double low = std::min({p[0]->y(), p[1]->y(), p[2]->y()});
    const double high = std::max({p[0]->y(), p[1]->y(), p[2]->y()});
    const int first = std::max(0, static_cast<int>(std::ceil(low - 0.5)));
    const int last = std::min(rows_ - 1, static_cast<int>(std::floor(high - 0.5)));
    for (int row = first; row <= last; ++row) drawRow(p, row);
  }
  double area() const {
    const auto filled = std::ranges::count(cells_, 1);
    return static_cast<double>(filled) * cell_ * cell_;
  }

 private:
  int sizeOf(double length) const {
    return std::max(1, static_cast<int>(std::ceil(length / cell_)));
  }

  void drawRow(const Triangle& p, int row) {
    const double y = row + 0.5;
    double left = 1e9, right = -1e9;
    for (std::size_t i = 0; i < 3; ++i) {
      const Eigen::Vector2d &a = *p[i], &b = *p[(i + 1) % 3];
      if ((a.y() <= y) == (b.y() <= y)) continue;
      const double x = a.x() + (b.x() - a.x()) * ((y - a.y()) / (b.y() - a.y()));
      left = std::min(left, x), right = std::max(right, x);
    }
    const int first = std::max(0, static_cast<int>(std::ceil(std::max(left, -1.0) - 0.5)));
    const int last = static_cast<int>(std::floor(std::min<double>(right, columns_) - 0.5));
    for (int column = first; column <= std::min(last, columns_ - 1); ++column) {
      cells_[static_cast<std::size_t>(row * columns_ + column)] = 1;
    }
  }

  double x_, y_, cell_;
  int columns_, rows_;
  std::vector<char> cells_;
};

Box enlargedPlane(const Lens& lens) {
  const double w = lens.width(), h = lens.height();
  return {-w - 0.5, -h - 0.5, 2.0 * w - 0.5, 2.0 * h - 0.5};
}

void include(Box& box, const Eigen::Vector2d& pixel) {
  box.x1 = std::min(box.x1, pixel.x()), box.x2 = std::max(box.x2, pixel.x());
  box.y1 = std::min(box.y1, pixel.y()), box.y2 = std::max(box.y2, pixel.y());
}

/// The projected triangles of a surface, clipped at the near plane.
struct Projected {
  std::vector<Eigen::Vector2d> pixels;
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< indices of pixels
};

Projected projectSurface(const Surface& surface, const RigidTransform& T_CO, const Lens& lens) {
  Projected result;
  std::vector<Eigen::Vector3d> points;
  points.reserve(surface.positions.size());
  result.pixels.reserve(surface.positions.size());
  const Eigen::Matrix3d R = T_CO.R();
  bool whole = true;
  for (const auto& position : surface.positions) {
    points.emplace_back(R * position.cast<double>() + T_CO.p);
    const bool before = points.back().z() >= kNearPlane;
    result.pixels.push_back(before ? lens.projectBeyond(points.back()) : Eigen::Vector2d::Zero());
    whole = whole && before;
  }
  if (whole) {
    result.triangles = surface.triangles;
    return result;
  }
  Polygon polygon;
  std::vector<Eigen::Vector2d> pixels;
  for (const auto& [i, j, k] : surface.triangles) {
    cutNear({points[i], points[j], points[k]}, polygon);
    const auto first = static_cast<std::uint32_t>(pixels.size());
    for (const auto& point : polygon) pixels.push_back(lens.projectBeyond(point));
    for (std::uint32_t n = 2; n < polygon.size(); ++n) {
      result.triangles.push_back({first, first + n - 1, first + n});
    }
  }
  result.pixels.swap(pixels);
  return result;
}

/// Keeps the part of a polygon with sign · (coordinate − border) >= 0.
void cutBorder(std::vector<Eigen::Vector2d>& polygon, int axis, double border, double sign) {
  std::vector<Eigen::Vector2d> kept;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Eigen::Vector2d &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    const double from = sign * (a[axis] - border), to = sign * (b[axis] - border);
    if (from >= 0.0) kept.push_back(a);
    if ((from >= 0.0) != (to >= 0.0)) kept.push_back(a + (b - a) * (from / (from - to)));
  }
  polygon.swap(kept);
}

/// Box around the triangles' parts within the image; empty if there are none.
std::optional<Box> boxInside(const Projected& projected, const Box& image) {
  Box box{1e9, 1e9, -1e9, -1e9};
  std::vector<Eigen::Vector2d> part;
  for (const auto& [i, j, k] : projected.triangles) {
    part = {projected.pixels[i], projected.pixels[j], projected.pixels[k]};
    cutBorder(part, 0, image.x1, 1.0);
    cutBorder(part, 0, image.x2, -1.0);
    cutBorder(part, 1, image.y1, 1.0);
    cutBorder(part, 1, image.y2, -1.0);
    for (const auto& pixel : part) include(box, pixel);
  }
  return box.x1 > box.x2 ? std::nullopt : std::optional(box);
}

/// Angle between the optical axis and the outermost ray of the image.
double widestAngle(const Lens& lens) {
  double widest = 0.0;
  for (const int column : {0, lens.width() - 1}) {
    for (const int row : {0, lens.height() - 1}) {
      if (!lens.sees(column, row)) return M_PI;
      widest = std::max(widest, std::acos(static_cast<double>(lens.direction(column, row).z())));
    }
  }
  return widest + 0.05;
}

/// Fast conservative test: true only if no part of the ball around `centre_C` is in the image.
bool isOutside(const Eigen::Vector3d& centre_C, double radius, double widest) {
  const double distance = centre_C.norm();
  if (distance <= radius) return false;
  const double off_axis = std::atan2(centre_C.head<2>().norm(), centre_C.z());
  return off_axis - std::asin(radius / distance) > widest;
}

}  // namespace

Outline outlineOf(const Surface& surface, const RigidTransform& T_CO, const Lens& lens) {
  Projected projected = projectSurface(surface, T_CO, lens);
  Outline outline;
  if (projected.triangles.empty()) return outline;
  Box box{1e9, 1e9, -1e9, -1e9};
  for (const auto& pixel : projected.pixels) include(box, pixel);
  const Box plane = enlargedPlane(lens);
  box = {std::max(box.x1, plane.x1), std::max(box.y1, plane.y1), std::min(box.x2, plane.x2),
         std::min(box.y2, plane.y2)};
  if (box.width() <= 0.0 || box.height() <= 0.0) return outline;
  const Box image{-0.5, -0.5, lens.width() - 0.5, lens.height() - 0.5};
  if (box.x1 < image.x1 || box.y1 < image.y1 || box.x2 > image.x2 || box.y2 > image.y2) {
    outline.inside = boxInside(projected, image);
  }
  const double longer = std::max(box.width(), box.height());
  Raster raster(box, longer / std::clamp(4.0 * longer, kMinCells, kMaxCells));
  for (auto& pixel : projected.pixels) pixel = raster.cellOf(pixel);
  const auto* p = projected.pixels.data();
  for (const auto& [i, j, k] : projected.triangles) raster.draw({p + i, p + j, p + k});
  outline.area = raster.area();
  outline.box = box;
  return outline;
}

std::vector<sim::TruthView> viewsOf(const World& world, const Lens& lens, const Shot& shot,
                                    const Picture& seen, int step, Workers& workers) {
  const auto& objects = world.scene().objects;
  std::vector<std::size_t> pixels(world.instances().size(), 0);
  for (const auto instance : seen.instance) {
    if (instance != kNothing) ++pixels[instance];
  }
  const RigidTransform T_CW = (shot.body.T_WB * shot.T_BC).inverse();
  const double widest = widestAngle(lens);
  std::vector<std::optional<sim::TruthView>> found(objects.size());
  workers.run(objects.size(), [&](std::size_t i) {
    const Instance& instance = world.instances()[i + 1];
    if (!instance.present) return;
    const RigidTransform T_CO = T_CW * RigidTransform(Eigen::Matrix3d(instance.R.cast<double>()),
                                                      instance.p.cast<double>());
    if (isOutside(T_CO.p, 0.5 * objects[i].size.norm(), widest)) return;
    const Outline outline = outlineOf(*instance.surface, T_CO, lens);
    const Box& box = outline.box;
    if (outline.area <= 0.0 || box.x2 < -0.5 || box.y2 < -0.5 || box.x1 > lens.width() - 0.5 ||
        box.y1 > lens.height() - 0.5) {
      return;
    }
    const double visible = static_cast<double>(pixels[i + 1]) * step * step;
    found[i] =
        sim::TruthView{objects[i].id, std::min(1.0, visible / outline.area), box, outline.inside};
  });
  std::vector<sim::TruthView> views;
  for (const auto& view : found) {
    if (view) views.push_back(*view);
  }
  std::ranges::sort(views, [](const auto& a, const auto& b) { return a.object_id < b.object_id; });
  return views;
}

}  // namespace perdure::tools
