#include "common/mapping/view_search.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "common/mapping/frames/level_errors.h"
#include "common/mapping/graph/components.h"
#include "common/math/gaussian.h"

namespace perdure::mapping {
namespace {

constexpr std::size_t kLeastPoints = 8;
constexpr double kElsewhere_m = 3.0, kElsewhere_rad = 0.15;  // least separation of two places

/// One candidate pose, from matching the present view with that of an anchor.
struct Way {
  AnchorId anchor = 0;
  LevelGaussian T_MB;
  ViewMatch match;
};

bool isElsewhere(const LevelPose& a, const LevelPose& b) {
  const LevelError d = difference(a, b);
  return d.head<2>().norm() > kElsewhere_m || std::abs(d[3]) > kElsewhere_rad;
}

std::optional<Way> wayTo(AnchorId anchor, const Whereabouts& body, const View& seen) {
  const auto match = matchViews(body.state.viewFrom(anchor), seen);
  if (!match) return std::nullopt;
  const LevelPose& T_Ma = body.state.graph().pose(anchor);
  return Way{anchor, {T_Ma * match->T_AB.mean, turnedBy(T_Ma.R(), match->T_AB.covariance)}, *match};
}

/// Returns the best candidate, with the score of the best one at another place as `next`, and sets
/// `home` to its anchor.
std::optional<PlaceMatch> bestOf(const std::vector<Way>& ways, AnchorId& home) {
  const auto best = std::max_element(ways.begin(), ways.end(), [](const Way& a, const Way& b) {
    return a.match.nats < b.match.nats;
  });
  if (best == ways.end()) return std::nullopt;
  PlaceMatch match;
  match.T_MB = best->T_MB;
  match.score = best->match.nats;
  match.points = best->match.points;
  for (const Way& way : ways) {
    if (isElsewhere(way.T_MB.mean, best->T_MB.mean)) {
      match.next = std::max(match.next, way.match.nats);
    }
  }
  home = best->anchor;
  return match;
}

}  // namespace

bool ViewSearch::isBelieved(const PlaceMatch& match) const {
  return match.points >= kLeastPoints &&
         match.score - match.next >= parameters_.loop.nats + std::log(match.cells);
}

std::optional<LoopSearch::Found> ViewSearch::nearby(const Whereabouts& body,
                                                    const View& seen) const {
  if (seen.size() < kLeastPoints) return std::nullopt;
  const double gate2 = parameters_.place.gate_sigmas * parameters_.place.gate_sigmas;
  std::vector<Way> ways;
  std::size_t asked = 0;
  for (const auto& [distance, id] : anchorsOfBefore(body, parameters_)) {
    const auto T_ba = body.to(id);
    if (!T_ba || body.state.viewFrom(id).empty()) continue;
    ++asked;
    const auto way = wayTo(id, body, seen);
    if (!way) continue;
    // Covariance of the difference of the candidate from the prior pose relative to this anchor.
    const LevelGaussian prior = bodyByGraph(body, *T_ba);
    Eigen::Matrix4d S = prior.covariance + way->T_MB.covariance;
    addFloor(S, parameters_.loop.floor_m, parameters_.loop.floor_rad);
    const LevelError d = difference(way->T_MB.mean, prior.mean);
    if (squaredMahalanobis(d, S) < 4.0 * gate2) ways.push_back(*way);
  }
  AnchorId home = 0;
  auto match = bestOf(ways, home);
  if (!match) return std::nullopt;
  match->cells = static_cast<double>(asked);
  const auto T_ba = body.to(home);
  LevelGaussian prior = bodyByGraph(body, *T_ba);
  const double sigma_m = planeSigma(prior.covariance);
  const bool gains = planeSigma(match->T_MB.covariance) < parameters_.loop.tracked_gain * sigma_m;
  if (!gains || !isBelieved(*match)) return std::nullopt;
  addFloor(prior.covariance, parameters_.loop.floor_m, parameters_.loop.floor_rad);
  return LoopSearch::Found{*match, home, prior, sigma_m};
}

std::optional<LoopSearch::Found> ViewSearch::elsewhere(const Whereabouts& body,
                                                       const View& seen) const {
  if (body.state.graph().components() < 2 || seen.size() < kLeastPoints) return std::nullopt;
  const auto components = componentsOf(body.state.graph());
  const AnchorId own = components.at(body.here().id);
  std::vector<Way> ways;
  std::size_t asked = 0;
  for (const auto& [id, component] : components) {
    if (component == own || body.state.viewFrom(id).empty()) continue;
    ++asked;
    if (const auto way = wayTo(id, body, seen)) ways.push_back(*way);
  }
  AnchorId home = 0;
  auto match = bestOf(ways, home);
  if (!match) return std::nullopt;
  match->cells = static_cast<double>(asked);
  if (!isBelieved(*match)) return std::nullopt;
  return LoopSearch::Found{*match, home, std::nullopt, std::numeric_limits<double>::infinity()};
}

bool ViewSearch::contradicts(const LoopSearch::Found& found, const Whereabouts& body,
                             const View& seen) const {
  const auto components = componentsOf(body.state.graph());
  // Views of this visit are excluded, because they depend on the assumed pose of the body.
  const auto of_late = body.anchorsOfVisit(parameters_.loop.visit_m);
  std::vector<Way> ways;
  for (const auto& [id, component] : components) {
    const bool of_before = (id < of_late.front() || id > of_late.back()) && body.asks(id);
    if (component != components.at(found.home) || !of_before) continue;
    if (body.state.viewFrom(id).empty()) continue;
    const double distance =
        (body.state.graph().pose(id).p - found.match.T_MB.mean.p).head<2>().norm();
    if (distance > parameters_.loop.view_m) continue;
    if (const auto way = wayTo(id, body, seen)) ways.push_back(*way);
  }
  AnchorId home = 0;
  const auto match = bestOf(ways, home);
  return match && isBelieved(*match) && isElsewhere(match->T_MB.mean, found.match.T_MB.mean);
}

}  // namespace perdure::mapping
