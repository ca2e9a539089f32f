#include "services/semantic_filter/core/visibility/return_time.h"

#include <algorithm>
#include <cmath>

#include "services/semantic_filter/core/belief/motion_model.h"
#include "services/semantic_filter/core/visibility/occlusion.h"

namespace perdure::semantic_filter {
namespace {

constexpr double kHorizon_s = 10.0;
constexpr double kStride_s = 0.25;        // a shorter visible time may be overlooked
constexpr std::size_t kMostBlockers = 6;  // those nearest to the object in the image
constexpr double kCellsAcross = 16.0;     // cells of the depth buffer across the object
// share of visibility.minimum from which the object may be detected
constexpr double kMayBeFound = 0.5;
constexpr double kSliver = 0.01;      // visible fraction that is never detected
constexpr double kNineInTen = 1.645;  // deviations of a Gaussian, for an interval of nine in ten

using Walk = ScratchVector<View>;  // one view for each frame, the present one first

/// Returns the views of the next kHorizon_s. `way_scale`: factor on the translation.
Walk walkOn(const View& now, const Way& way, double way_scale) {
  Walk walk{now};
  const RigidTransform step(way.step.q, way_scale * way.step.p);
  const auto frames = static_cast<std::size_t>(std::ceil(kHorizon_s / way.seconds));
  while (walk.size() <= frames) {
    walk.push_back(walk.back());
    walk.back().T_WB = walk.back().T_WB * step;
  }
  return walk;
}

struct Standing {
  const Track* track;
  State x;
  const Shape* shape;
};

const Shape& shapeOf(const Track& track, const FrameInput& now) {
  return now.styles()->of(track.best().class_name).shape;
}

/// Returns the tracks that may hide `hidden` along the path: solid, nearer, and next to it in the
/// image.
ScratchVector<Standing> blockersOf(const std::vector<Track>& tracks, const Track& hidden,
                                   const FrameInput& now, const VisibilityParameters& parameters) {
  const Eigen::Vector3d eye = now.view.T_WC().p;
  const Eigen::Vector3d ray = hidden.best().x.head<3>() - eye;
  ScratchVector<std::pair<double, Standing>> near;
  for (const Track& o : tracks) {
    if (o.id == hidden.id || o.existence * o.history.recent_share < parameters.solid) continue;
    const State x = stateAt(o.best(), toSeconds(now.stamp.time - o.as_of));
    const Eigen::Vector3d other = x.head<3>() - eye;
    if (other.norm() > ray.norm()) continue;
    const double apart = std::atan2(ray.cross(other).norm(), ray.dot(other));
    near.push_back({o.id == hidden.visibility.blocked_by ? 0.0 : apart, {&o, x, &shapeOf(o, now)}});
  }
  const std::size_t kept = std::min(near.size(), kMostBlockers);
  std::partial_sort(near.begin(), near.begin() + static_cast<std::ptrdiff_t>(kept), near.end(),
                    [](const auto& a, const auto& b) { return a.first < b.first; });
  ScratchVector<Standing> result;
  for (std::size_t i = 0; i < kept; ++i) result.push_back(near[i].second);
  return result;
}

bool apart(const Eigen::Vector4d& a, const Eigen::Vector4d& b) {
  return a[2] < b[0] || b[2] < a[0] || a[3] < b[1] || b[3] < a[1];
}

/// Returns the part of the convex hull of `points` that lies within `sides`.
Polygon within(const Eigen::Vector4d& sides, const Polygon& points) {
  Polygon part = clip(clip(convexHull(points), 0, sides[0], true), 0, sides[2], false);
  return clip(clip(part, 1, sides[1], true), 1, sides[3], false);
}

/// Returns the visible fraction of the first of `things`, by a finer depth buffer than a frame's.
double shareInSight(const ScratchVector<Standing>& things, const View& view,
                    VisibilityParameters parameters) {
  const Projector from(view);
  const Standing& first = things.front();
  const ScratchScope scope;
  ScratchVector<Outline> outlines;
  outlines.reserve(things.size());
  outlines.push_back(outlineOf(*first.track, first.x, from, *first.shape));
  if (!outlines.front().box) return 0.0;
  const Eigen::Vector4d sides = outlines.front().box->sides;
  const CameraModel& camera = *view.camera;
  if (apart(sides, {0.0, 0.0, camera.width(), camera.height()})) return 0.0;
  for (auto s = things.begin() + 1; s != things.end(); ++s) {
    Outline blocker = outlineOf(*s->track, s->x, from, *s->shape);
    if (!blocker.box || apart(blocker.box->sides, sides)) continue;
    blocker.box->points = within(sides, blocker.box->points);
    outlines.push_back(std::move(blocker));
  }
  const double side = std::min(sides[2] - sides[0], sides[3] - sides[1]);
  parameters.cell_px = std::clamp(static_cast<std::int64_t>(side / kCellsAcross), std::int64_t{1},
                                  parameters.cell_px);
  return shareOfFirst(outlines, camera, parameters);
}

/// Returns the visible fraction from which the first of `things` may be detected. If so much is
/// visible already without a detection, the fraction at which a miss counts is required.
double shareToBeFound(const ScratchVector<Standing>& things, const View& now,
                      const VisibilityParameters& parameters) {
  const double sure = std::max(parameters.minimum, kSliver), least = kMayBeFound * sure;
  return shareInSight(things, now, parameters) < least ? least : sure;
}

/// Returns the first later frame with the visible fraction `share` of the first of `things`.
std::optional<std::size_t> firstInSight(const ScratchVector<Standing>& things, const Walk& walk,
                                        double share, double frame_s,
                                        const VisibilityParameters& parameters) {
  const auto inSight = [&](std::size_t n) {
    return shareInSight(things, walk[n], parameters) >= share;
  };
  const auto stride = static_cast<std::size_t>(std::max(1.0, std::floor(kStride_s / frame_s)));
  for (std::size_t n = stride; n < walk.size(); n += stride) {
    if (!inSight(n)) continue;
    std::size_t first = n - stride + 1;
    while (first < n && !inSight(first)) ++first;
    return first;
  }
  return std::nullopt;
}

/// Returns the number of frames after `first` until the object is almost surely detected.
std::size_t framesToFind(const ScratchVector<Standing>& things, const Walk& walk, std::size_t first,
                         const VisibilityParameters& parameters) {
  constexpr double kMissed = 0.05;
  double missed = 1.0;
  std::size_t n = first;
  for (; n < walk.size() && missed > kMissed; ++n) {
    missed *= 1.0 - shareInSight(things, walk[n], parameters);
  }
  return n - first;
}

/// Returns deviations of the state, one sigma each, that move the occluding edges.
ScratchVector<State> deviationsOf(const Standing& thing, const Eigen::Vector3d& eye) {
  const StateCovariance& P = thing.track->best().P;
  const Eigen::Vector3d ray = (thing.x.head<3>() - eye).normalized();
  Eigen::Vector3d across = ray.cross(Eigen::Vector3d::UnitZ());
  across = across.norm() > 1e-6 ? Eigen::Vector3d(across.normalized()) : Eigen::Vector3d::UnitX();
  ScratchVector<State> deviations;
  for (const Eigen::Vector3d& axis : {ray, across}) {
    State d = State::Zero();
    d.head<3>() = std::sqrt(std::max(axis.dot(P.topLeftCorner<3, 3>() * axis), 0.0)) * axis;
    deviations.push_back(d);
  }
  State grown = State::Zero();
  for (int i = kSize; i < kSize + 3; ++i) grown[i] = std::sqrt(std::max(P(i, i), 0.0));
  deviations.push_back(grown);
  return deviations;
}

/// Squared distances of both ends of the interval from the expected time, s². They may differ.
struct Spread {
  Spread(double expected_s, double frame_s)
      : expected(expected_s), early(frame_s * frame_s), late(early) {}
  void add(double one_s, double other_s) {
    const auto [first, last] = std::minmax(one_s, other_s);
    early += std::pow(std::max(expected - first, 0.0), 2);
    late += std::pow(std::max(last - expected, 0.0), 2);
  }
  double expected, early, late;
};

bool goes(const Way& way) { return way.seconds > 0.0 && way.step.p.allFinite(); }

ScratchVector<Standing> inPlay(const std::vector<Track>& tracks, const Track& hidden,
                               const FrameInput& now, const VisibilityParameters& parameters) {
  ScratchVector<Standing> things{{&hidden,
                                  stateAt(hidden.best(), toSeconds(now.stamp.time - hidden.as_of)),
                                  &shapeOf(hidden, now)}};
  const auto blockers = blockersOf(tracks, hidden, now, parameters);
  things.insert(things.end(), blockers.begin(), blockers.end());
  return things;
}

}  // namespace

std::optional<double> expectedReappearance(const std::vector<Track>& tracks, const Track& hidden,
                                           const FrameInput& now, const Way& way,
                                           const VisibilityParameters& parameters) {
  if (!goes(way)) return std::nullopt;
  const auto things = inPlay(tracks, hidden, now, parameters);
  const auto n =
      firstInSight(things, walkOn(now.view, way, 1.0), shareToBeFound(things, now.view, parameters),
                   way.seconds, parameters);
  return n ? std::optional(way.seconds * static_cast<double>(*n)) : std::nullopt;
}

std::optional<ReappearanceInterval> reappearanceInterval(const std::vector<Track>& tracks,
                                                         const Track& hidden, const FrameInput& now,
                                                         const Way& way,
                                                         const VisibilityParameters& parameters) {
  if (!goes(way)) return std::nullopt;
  const double speed = way.step.p.norm() / way.seconds;
  auto things = inPlay(tracks, hidden, now, parameters);
  const Walk walk = walkOn(now.view, way, 1.0);
  const double share = shareToBeFound(things, now.view, parameters);
  const auto expected = firstInSight(things, walk, share, way.seconds, parameters);
  if (!expected) return std::nullopt;
  const auto at = [&](const Walk& on) {
    const auto n = firstInSight(things, on, share, way.seconds, parameters).value_or(walk.size());
    return way.seconds * static_cast<double>(n);
  };
  ReappearanceInterval result;
  result.expected = way.seconds * static_cast<double>(*expected);
  Spread spread(result.expected, way.seconds);
  const std::size_t found = framesToFind(things, walk, *expected, parameters);
  spread.add(result.expected + way.seconds * static_cast<double>(found), result.expected);
  const double walked = way.speed_walk * std::sqrt(result.expected / 3.0) / std::max(speed, 1e-3);
  const double way_scale = kNineInTen * walked;
  const double slower = way_scale < 1.0 ? at(walkOn(now.view, way, 1.0 - way_scale)) : kHorizon_s;
  spread.add(slower, at(walkOn(now.view, way, 1.0 + way_scale)));
  for (std::size_t i = 0; i < std::min<std::size_t>(things.size(), 2); ++i) {
    const State x = things[i].x;
    for (const State& d : deviationsOf(things[i], now.view.T_WC().p)) {
      things[i].x = x + kNineInTen * d;
      const double one = at(walk);
      things[i].x = x - kNineInTen * d;
      spread.add(one, at(walk));
    }
    things[i].x = x;
  }
  result.earliest = std::max(0.0, result.expected - std::sqrt(spread.early));
  result.latest = result.expected + std::sqrt(spread.late);
  return result;
}

}  // namespace perdure::semantic_filter
