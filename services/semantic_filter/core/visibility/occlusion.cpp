#include "services/semantic_filter/core/visibility/occlusion.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <utility>

#include "services/semantic_filter/core/measurement/polygon.h"

namespace perdure::semantic_filter {
namespace {

struct Cell {
  double transmittance = 1.0;              ///< probability that nothing painted hides it
  double distance_m = 0.0, sigma_m = 0.0;  ///< of the most solid occluder
  double strongest = 0.0;
  ObjectId blocker = 0;
};

/// Adjacent cells of a row; x and y (px) are the centre of the first one.
struct Span {
  std::size_t first;
  int cells;
  double x, y;
};

/// A grid of cells, reused for every painting; a stamp marks the cells of the present one.
class DepthBuffer {
 public:
  void begin(double width, double height, double cell_px) {
    cell_ = cell_px;
    columns_ = static_cast<int>(std::ceil(width / cell_px));
    rows_ = static_cast<int>(std::ceil(height / cell_px));
    const std::size_t cells = static_cast<std::size_t>(columns_) * rows_;
    if (cells > cells_.size()) cells_.resize(cells), painted_.resize(cells, 0);
    if (++painting_ == 0) {
      std::fill(painted_.begin(), painted_.end(), 0);
      painting_ = 1;
    }
  }

  /// Returns nullptr if nothing was painted in the cell.
  const Cell* find(std::size_t i) const { return painted_[i] == painting_ ? &cells_[i] : nullptr; }
  Cell& at(std::size_t i) {
    if (std::exchange(painted_[i], painting_) != painting_) cells_[i] = {};
    return cells_[i];
  }
  double cell() const { return cell_; }

  /// Returns the cells whose centres lie in the polygon, row by row. A polygon smaller than a cell
  /// gets at least one. The result is valid until the next call.
  const std::vector<Span>& spansOf(const Polygon& hull) {
    spans_.clear();
    if (hull.empty()) return spans_;
    double low = 1e30, high = -1e30;
    for (const auto& p : hull) low = std::min(low, p.y()), high = std::max(high, p.y());
    const int top = rowOf(low);
    edges_.assign(static_cast<std::size_t>(rowOf(high) - top + 1), {1e30, -1e30});
    for (std::size_t i = 0; i < hull.size(); ++i) {
      const auto& a = hull[i];
      cross(a, hull[i + 1 < hull.size() ? i + 1 : 0], top);
    }
    for (std::size_t i = 0; i < edges_.size(); ++i) {
      const auto [left, right] = edges_[i];
      if (left > right) continue;
      const int row = top + static_cast<int>(i);
      const int first = std::max(0, static_cast<int>(std::ceil(left / cell_ - 0.5)));
      const int last = std::min(columns_ - 1, static_cast<int>(std::floor(right / cell_ - 0.5)));
      if (first > last) continue;
      spans_.push_back(
          {indexOf(row, first), last - first + 1, (first + 0.5) * cell_, centreOf(row)});
    }
    if (!spans_.empty()) return spans_;
    const Eigen::Vector2d centre =
        std::accumulate(hull.begin(), hull.end(), Eigen::Vector2d(0, 0)) / double(hull.size());
    spans_.push_back({indexOf(rowOf(centre.y()), columnOf(centre.x())), 1, centre.x(), centre.y()});
    return spans_;
  }

 private:
  struct Edges {
    double left, right;
  };

  int rowOf(double y) const { return std::clamp(static_cast<int>(y / cell_), 0, rows_ - 1); }
  int columnOf(double x) const { return std::clamp(static_cast<int>(x / cell_), 0, columns_ - 1); }
  double centreOf(int row) const { return (row + 0.5) * cell_; }
  std::size_t indexOf(int row, int column) const {
    return static_cast<std::size_t>(row) * columns_ + column;
  }
  /// Enters the line from a to b into the edges of the rows whose centres it crosses.
  void cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b, int top) {
    const double low = std::min(a.y(), b.y()), high = std::max(a.y(), b.y());
    if (!(low < high)) return;
    const double slope = (b.x() - a.x()) / (b.y() - a.y());
    const int end = top + static_cast<int>(edges_.size());
    for (int row = std::max(top, static_cast<int>(std::ceil(low / cell_ - 0.5))); row < end;
         ++row) {
      const double y = centreOf(row);
      if (y >= high) break;
      Edges& edges = edges_[static_cast<std::size_t>(row - top)];
      const double x = a.x() + (y - a.y()) * slope;
      edges.left = std::min(edges.left, x), edges.right = std::max(edges.right, x);
    }
  }

  double cell_ = 1.0;
  int columns_ = 0, rows_ = 0;
  std::vector<Cell> cells_;
  std::vector<std::uint32_t> painted_;  ///< the painting that each cell belongs to
  std::uint32_t painting_ = 0;
  std::vector<Span> spans_;
  std::vector<Edges> edges_;  ///< of a polygon, for each row
};

/// Returns the probability that the occluder in the cell is nearer than the object.
double nearer(const Cell& cell, const Outline& o) {
  const double sigma = std::hypot(cell.sigma_m, o.depth_sigma_m) + 1e-3;
  return 0.5 * std::erfc((cell.distance_m - o.distance_m) / (std::sqrt(2.0) * sigma));
}

/// An occluder of an object. `hidden`: the number of the object's cells that it hides.
struct Blocked {
  ObjectId by;
  double nearer;  ///< probability that the occluder is nearer than the object
  double hidden = 0.0;
};

class Blockers {
 public:
  explicit Blockers(const Outline& outline) : o_(outline) {}

  /// Returns the entry of the cell's occluder. The search begins with the newest entry, because
  /// adjacent cells usually have the same occluder.
  Blocked& of(const Cell& cell) {
    for (auto b = all_.rbegin(); b != all_.rend(); ++b) {
      if (b->by == cell.blocker) return *b;
    }
    all_.push_back({cell.blocker, nearer(cell, o_)});
    return all_.back();
  }
  const ScratchVector<Blocked>& all() const { return all_; }

 private:
  const Outline& o_;
  ScratchVector<Blocked> all_;
};

struct Tally {
  explicit Tally(const Outline& outline) : o(outline), blockers(outline) {
    const auto& s = o.box->sides;
    const double band_x = 0.15 * (s[2] - s[0]), band_y = 0.15 * (s[3] - s[1]);
    inner = {s[0] + band_x, s[1] + band_y, s[2] - band_x, s[3] - band_y};
  }

  /// Adds a row of cells as if nothing hid them.
  void add(const Span& span, double cell_px) {
    const double cells = span.cells;
    const auto upTo = [&](double limit) {  // number of cells whose centre is below
      return std::clamp(std::ceil((limit - span.x) / cell_px), 0.0, cells);
    };
    total += cells;
    side_total[0] += upTo(inner[0]);
    side_total[2] += cells - upTo(std::nextafter(inner[2], 1e30));
    if (span.y < inner[1]) side_total[1] += cells;
    if (span.y > inner[3]) side_total[3] += cells;
  }
  /// Adds the hidden share of a painted cell of such a row.
  void hide(const Cell& cell, double x, double y) {
    Blocked& blocked = blockers.of(cell);
    const double share = (1.0 - cell.transmittance) * blocked.nearer;
    blocked.hidden += share;
    hidden += share;
    if (x < inner[0]) side_hidden[0] += share;
    if (y < inner[1]) side_hidden[1] += share;
    if (x > inner[2]) side_hidden[2] += share;
    if (y > inner[3]) side_hidden[3] += share;
  }

  const Outline& o;
  std::array<double, 4> inner;  ///< inner ends of the bands along the four sides
  double total = 0.0, hidden = 0.0;
  Blockers blockers;
  std::array<double, 4> side_total{}, side_hidden{};
};

void paint(Cell& cell, const Outline& o) {
  if (o.solidity > cell.strongest) {
    cell.strongest = o.solidity;
    cell.blocker = o.id;
    cell.distance_m = o.distance_m;
    cell.sigma_m = o.depth_sigma_m;
  }
  cell.transmittance *= 1.0 - o.solidity;
}

/// Returns the share of the outline's landmarks that lie in front of the surface of the object.
/// Landmarks at or behind it lower the share (paper, line 190: the co-visibility cue).
double hiddenByPoints(const Outline& o, const Polygon& hull,
                      const std::vector<LandmarkDepth>& points) {
  double before = 0.0, through = 0.0;
  const double surface = o.distance_m - o.extent_m;
  for (const auto& p : points) {
    bool inside = !hull.empty();
    for (std::size_t i = 0; i < hull.size() && inside; ++i) {
      inside = cross(hull[i], hull[(i + 1) % hull.size()], p.pixel) >= 0;
    }
    if (!inside) continue;
    const double margin = 2.0 * std::hypot(p.sigma_m, o.depth_sigma_m) + 0.1 * surface;
    (p.distance_m < surface - margin ? before : through) += 1.0;
  }
  // three pseudo-landmarks on the object, so that a few landmarks cannot decide
  return before / (before + through + 3.0);
}

TrackVisibility classify(const Tally& tally, double in_image, double by_points,
                         const VisibilityParameters& parameters) {
  TrackVisibility visibility;
  const double free = tally.total > 0.0 ? 1.0 - tally.hidden / tally.total : 0.0;
  visibility.fraction = in_image * free * (1.0 - by_points);
  double most = 0.0;
  for (const Blocked& b : tally.blockers.all()) {
    const bool older = b.hidden == most && b.by < visibility.blocked_by;
    if (b.hidden > most || older) most = b.hidden, visibility.blocked_by = b.by;
  }
  if (most < 0.1 * tally.total) visibility.blocked_by = 0;
  for (int i = 0; i < 4; ++i) {
    visibility.hidden_sides[i] =
        tally.side_total[i] > 0.0 && tally.side_hidden[i] > 0.5 * tally.side_total[i];
  }
  if (visibility.fraction < parameters.minimum) {
    visibility.residual_fraction = visibility.fraction;
    visibility.fraction = 0.0;
    visibility.state =
        in_image < parameters.minimum ? Visibility::kOutOfView : Visibility::kOccluded;
  } else {
    visibility.state =
        visibility.fraction >= parameters.full ? Visibility::kVisible : Visibility::kPartial;
  }
  return visibility;
}

/// The part of an outline that lies in the image, and its share of the whole.
struct InImage {
  Polygon inside;
  double share;
};

/// Returns the solid angle of a polygon of the image; distortion is ignored. In pixels, the near
/// end of an object beside the camera would count far too much.
double solidAngleOf(Polygon pixels, const CameraModel& camera) {
  for (auto& p : pixels) {
    p = {(p.x() - camera.cx()) / camera.fx(), (p.y() - camera.cy()) / camera.fy()};
  }
  return solidAngle(pixels);
}

InImage inImage(const Outline& o, const CameraModel& camera) {
  const Polygon hull = convexHull(o.box->points);
  InImage result;
  result.inside = clip(clip(hull, 0, 0.0, true), 0, camera.width(), false);
  result.inside = clip(clip(result.inside, 1, 0.0, true), 1, camera.height(), false);
  result.share = solidAngleOf(result.inside, camera) / std::max(solidAngleOf(hull, camera), 1e-12);
  return result;
}

void paint(DepthBuffer& buffer, const std::vector<Span>& spans, const Outline& o) {
  for (const Span& span : spans) {
    for (int i = 0; i < span.cells; ++i) {
      paint(buffer.at(span.first + static_cast<std::size_t>(i)), o);
    }
  }
}

Tally tallyOf(const DepthBuffer& buffer, const std::vector<Span>& spans, const Outline& o) {
  Tally tally(o);
  for (const Span& span : spans) {
    tally.add(span, buffer.cell());
    for (int i = 0; i < span.cells; ++i) {
      const Cell* cell = buffer.find(span.first + static_cast<std::size_t>(i));
      if (cell) tally.hide(*cell, span.x + i * buffer.cell(), span.y);
    }
  }
  return tally;
}

DepthBuffer& begin(const CameraModel& camera, const VisibilityParameters& parameters) {
  thread_local DepthBuffer kept;
  kept.begin(camera.width(), camera.height(), static_cast<double>(parameters.cell_px));
  return kept;
}

}  // namespace

Outline outlineOf(const Track& track, const State& x, const Projector& from, const Shape& shape) {
  const Hypothesis& h = track.best();
  const Eigen::Vector3d ray = x.head<3>() - from.T_WC.p;
  Outline o;
  o.id = track.id;
  o.solidity = track.existence * track.history.recent_share;
  o.distance_m = ray.norm();
  const Eigen::Vector3d along = ray / std::max(o.distance_m, 1e-6);
  o.depth_sigma_m = std::sqrt(std::max(along.dot(h.P.topLeftCorner<3, 3>() * along), 0.0));
  o.extent_m = 0.5 * x.segment<3>(kSize).array().exp().maxCoeff();
  o.box = projectOutline(x, from, shape);
  return o;
}

double shareOfFirst(const ScratchVector<Outline>& outlines, const CameraModel& camera,
                    const VisibilityParameters& parameters) {
  const Outline& first = outlines.front();
  if (!first.box) return 0.0;
  ScratchVector<const Outline*> hiding;
  for (const Outline& o : outlines) {
    const bool hides = o.box && o.distance_m < first.distance_m && o.solidity >= parameters.solid;
    if (hides) hiding.push_back(&o);
  }
  const InImage in_image = inImage(first, camera);
  if (in_image.inside.empty()) return 0.0;
  if (hiding.empty()) return in_image.share;
  std::stable_sort(hiding.begin(), hiding.end(),
                   [](const auto* a, const auto* b) { return a->distance_m < b->distance_m; });
  DepthBuffer& buffer = begin(camera, parameters);
  for (const Outline* o : hiding) {
    paint(buffer, buffer.spansOf(inImage(*o, camera).inside), *o);
  }
  double cells = 0.0, hidden = 0.0;
  Blockers blockers(first);
  for (const Span& span : buffer.spansOf(in_image.inside)) {
    cells += span.cells;
    for (int i = 0; i < span.cells; ++i) {
      const Cell* cell = buffer.find(span.first + static_cast<std::size_t>(i));
      if (cell) hidden += (1.0 - cell->transmittance) * blockers.of(*cell).nearer;
    }
  }
  return cells > 0.0 ? in_image.share * (1.0 - hidden / cells) : 0.0;
}

ScratchVector<TrackVisibility> computeVisibility(const ScratchVector<Outline>& outlines,
                                                 const std::vector<LandmarkDepth>& points,
                                                 const CameraModel& camera,
                                                 const VisibilityParameters& parameters) {
  ScratchVector<std::size_t> order(outlines.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return outlines[a].distance_m < outlines[b].distance_m;
  });
  DepthBuffer& buffer = begin(camera, parameters);
  ScratchVector<TrackVisibility> visibilities(outlines.size());
  for (const std::size_t j : order) {
    const Outline& o = outlines[j];
    if (!o.box) continue;
    const InImage in_image = inImage(o, camera);
    const std::vector<Span>& spans = buffer.spansOf(in_image.inside);
    const Tally tally = tallyOf(buffer, spans, o);
    const double by_points = points.empty() ? 0.0 : hiddenByPoints(o, in_image.inside, points);
    visibilities[j] = classify(tally, in_image.share, by_points, parameters);
    if (o.solidity >= parameters.solid) paint(buffer, spans, o);
  }
  return visibilities;
}

}  // namespace perdure::semantic_filter
