#include "services/semantic_filter/core/foresee.h"

#include <algorithm>
#include <cmath>

#include "services/semantic_filter/core/predict.h"

namespace perdure::semantic_filter {
namespace {

constexpr double kHorizon_s = 10.0;
constexpr double kStride_s = 0.25;        // what is in sight for less may be passed over
constexpr std::size_t kMostBlockers = 6;  // those next to it in the image
constexpr double kNineInTen = 1.645;      // deviations of a Gaussian
constexpr double kMostSpeedChange = 0.9;  // relative

using Walk = std::vector<View>;  // one a frame, the present one first

/// `pace`: of the translation, relative.
Walk walkOn(const View& now, const Way& way, double pace) {
  Walk walk{now};
  const RigidTransform step(way.step.q, pace * way.step.p);
  const auto frames = static_cast<std::size_t>(std::ceil(kHorizon_s / way.seconds));
  while (walk.size() <= frames) {
    walk.push_back(walk.back());
    walk.back().T_WB = walk.back().T_WB * step;
  }
  return walk;
}

struct Standing {
  const Object* object;
  State x;
};

/// What may hide it on the way: solid, nearer, and next to it in the image.
std::vector<Standing> blockersOf(const std::vector<Object>& objects, const Object& hidden,
                                 const FrameInput& now, const VisibilityParameters& parameters) {
  const Eigen::Vector3d eye = now.view.T_WC().p;
  const Eigen::Vector3d ray = hidden.best().x.head<3>() - eye;
  std::vector<std::pair<double, Standing>> near;
  for (const Object& o : objects) {
    if (o.id == hidden.id || o.existence * o.support < parameters.solid) continue;
    const State x = stateAt(o.best(), toSeconds(now.stamp.time - o.as_of));
    const Eigen::Vector3d other = x.head<3>() - eye;
    if (other.norm() > ray.norm()) continue;
    const double apart = std::atan2(ray.cross(other).norm(), ray.dot(other));
    near.push_back({o.id == hidden.blocked_by ? 0.0 : apart, {&o, x}});
  }
  const std::size_t kept = std::min(near.size(), kMostBlockers);
  std::partial_sort(near.begin(), near.begin() + static_cast<std::ptrdiff_t>(kept), near.end(),
                    [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<Standing> result;
  for (std::size_t i = 0; i < kept; ++i) result.push_back(near[i].second);
  return result;
}

/// The first frame after the present one from which some of the first of `things` is seen.
std::optional<std::size_t> firstInSight(const std::vector<Standing>& things, const Walk& walk,
                                        double frame_s, const VisibilityParameters& parameters) {
  const auto inSight = [&](std::size_t n) {
    std::vector<Outline> outlines;
    for (const Standing& s : things) outlines.push_back(outlineOf(*s.object, s.x, walk[n]));
    const CameraModel& camera = *walk[n].camera;
    return see(outlines, {}, camera.width(), camera.height(), parameters).front().fraction > 0.0;
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

/// By one deviation each: what moves the edges that hide it.
std::vector<State> deviationsOf(const Standing& thing, const Eigen::Vector3d& eye) {
  const StateCovariance& P = thing.object->best().P;
  const Eigen::Vector3d ray = (thing.x.head<3>() - eye).normalized();
  Eigen::Vector3d across = ray.cross(Eigen::Vector3d::UnitZ());
  across = across.norm() > 1e-6 ? Eigen::Vector3d(across.normalized()) : Eigen::Vector3d::UnitX();
  std::vector<State> deviations;
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

bool goes(const Way& way) { return way.seconds > 0.0 && way.step.p.allFinite(); }

std::vector<Standing> inPlay(const std::vector<Object>& objects, const Object& hidden,
                             const FrameInput& now, const VisibilityParameters& parameters) {
  std::vector<Standing> things{
      {&hidden, stateAt(hidden.best(), toSeconds(now.stamp.time - hidden.as_of))}};
  const auto blockers = blockersOf(objects, hidden, now, parameters);
  things.insert(things.end(), blockers.begin(), blockers.end());
  return things;
}

}  // namespace

std::optional<double> expectReturn(const std::vector<Object>& objects, const Object& hidden,
                                   const FrameInput& now, const Way& way,
                                   const VisibilityParameters& parameters) {
  if (!goes(way)) return std::nullopt;
  const auto n = firstInSight(inPlay(objects, hidden, now, parameters), walkOn(now.view, way, 1.0),
                              way.seconds, parameters);
  return n ? std::optional(way.seconds * static_cast<double>(*n)) : std::nullopt;
}

std::optional<Foreseen> foreseeReturn(const std::vector<Object>& objects, const Object& hidden,
                                      const FrameInput& now, const Way& way,
                                      const VisibilityParameters& parameters) {
  if (!goes(way)) return std::nullopt;
  const double speed = way.step.p.norm() / way.seconds;
  auto things = inPlay(objects, hidden, now, parameters);
  const Walk walk = walkOn(now.view, way, 1.0);
  const auto expected = firstInSight(things, walk, way.seconds, parameters);
  if (!expected) return std::nullopt;
  const auto at = [&](const Walk& on) {
    const auto n = firstInSight(things, on, way.seconds, parameters).value_or(walk.size());
    return way.seconds * static_cast<double>(n);
  };
  Foreseen result;
  result.expected = way.seconds * static_cast<double>(*expected);
  double variance = way.seconds * way.seconds / 12.0;  // of the frame in which it happens
  const auto add = [&](double late, double early) {
    variance += 0.25 * (late - early) * (late - early);
  };
  const double change = way.speed_walk * std::sqrt(result.expected / 3.0) / std::max(speed, 1e-3);
  const double pace = std::min(change, kMostSpeedChange);
  add(at(walkOn(now.view, way, 1.0 - pace)), at(walkOn(now.view, way, 1.0 + pace)));
  for (std::size_t i = 0; i < std::min<std::size_t>(things.size(), 2); ++i) {
    const State x = things[i].x;
    for (const State& d : deviationsOf(things[i], now.view.T_WC().p)) {
      things[i].x = x + d;
      const double one = at(walk);
      things[i].x = x - d;
      add(one, at(walk));
    }
    things[i].x = x;
  }
  const double reach = kNineInTen * std::sqrt(variance);
  result.earliest = std::max(0.0, result.expected - reach);
  result.latest = result.expected + reach;
  return result;
}

}  // namespace perdure::semantic_filter
