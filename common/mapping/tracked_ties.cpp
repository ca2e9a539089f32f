#include "common/mapping/tracked_ties.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/mapping/frames/level_errors.h"
#include "common/math/gaussian.h"
#include "common/math/so3.h"

namespace perdure::mapping {
namespace {

/// Largest share of the recalled position in an object's information. Above it, the position comes
/// too much from the map instead of detections.
constexpr double kMostLaid = 0.25;

struct Pair {
  ObjectId id = 0;
  AnchorId home = 0;         ///< anchor of the earlier visit
  PlacedObject seen, known;  ///< `seen` in B, `known` in M
};

MatchEquations equationsAt(const LevelPose& T_Mb, const std::vector<Pair>& pairs) {
  MatchEquations equations;
  for (const Pair& pair : pairs) equations.add(pair.seen, pair.known, T_Mb);
  return equations;
}

/// Removes all pairs except those of the visit that constrains the body's position best. Returns an
/// anchor of that visit, to which the edge leads.
AnchorId keepOneVisit(std::vector<Pair>& pairs, const MapState& state, double visit_m) {
  AnchorId best = 0;
  double most = 0.0;
  for (const Pair& of : pairs) {
    double information = 0.0;
    for (const Pair& pair : pairs) {
      if (!isOneVisit(state, of.home, pair.home, visit_m)) continue;
      information += 1.0 / (planeVariance(pair.seen) + planeVariance(pair.known));
    }
    if (information > most) best = of.home;
    most = std::max(most, information);
  }
  std::erase_if(pairs,
                [&](const Pair& pair) { return !isOneVisit(state, best, pair.home, visit_m); });
  return best;
}

}  // namespace

bool TrackedTies::isUsed(ObjectId id, double way_m) const {
  const auto at = used_at_m_.find(id);
  return at != used_at_m_.end() && way_m - at->second < parameters_.loop.visit_m;
}

/// The posterior covariance P of an object includes its recalled position as a prior. If the prior
/// has the share r of the information, detections alone have the covariance P / (1 − r).
std::optional<TrackedTies::Tie> TrackedTies::find(const Whereabouts& body) const {
  const LoopParameters& loop = parameters_.loop;
  const double way_m = body.way.way_m();
  const LevelPose x = body.state.graph().pose(body.here().id);
  std::vector<Pair> pairs;
  double laid_m = 0.0;
  for (const ObjectId id : body.objectsOfVisit(loop.fresh_m)) {
    const ObjectRecord& record = body.state.records().at(id);
    if (!record.confirmed || !record.earlier || isUsed(id, way_m)) continue;
    if (record.earlier->in_anchor.id != record.sighting.in_anchor.id) continue;
    const auto T_ba = body.to(record.earlier->anchor);
    const auto T_bA = body.to(record.sighting.anchor);
    if (!T_ba || !T_bA) continue;
    PlacedObject seen = laid(*T_bA, record.sighting.in_anchor);
    const double share =
        planeVariance(seen) / planeVariance(laid(*T_ba, record.earlier->in_anchor));
    if (share > kMostLaid) continue;
    seen.covariance /= 1.0 - share;
    const AnchorId home = record.earlier->anchor;
    pairs.push_back({id, home, std::move(seen), inM(body.state, *record.earlier)});
    laid_m = std::max(laid_m, planeSigma(T_ba->covariance));
  }
  Tie tie;
  tie.home = keepOneVisit(pairs, body.state, loop.visit_m);
  if (pairs.size() < loop.least_tracked) return std::nullopt;
  for (const Pair& pair : pairs) tie.objects.push_back(pair.id);
  LevelGaussian by_graph = bodyByGraph(body, *body.to(tie.home));
  addFloor(by_graph.covariance, loop.floor_m, loop.floor_rad);
  const Eigen::Vector4d step = equationsAt(x, pairs).stepNear(inverseSymmetric(by_graph.covariance),
                                                              Eigen::Vector4d::Zero());
  tie.T_Mb.mean = {x.p + step.head<3>(), wrapAngle(x.yaw + step[3])};
  // At this pose the residuals contain the errors of detections, but not the drift.
  tie.T_Mb.covariance = equationsAt(tie.T_Mb.mean, pairs).covariance();
  if (planeSigma(tie.T_Mb.covariance) > loop.tracked_gain * laid_m) return std::nullopt;
  return tie;
}

void TrackedTies::use(const Tie& tie, double way_m) {
  for (const ObjectId id : tie.objects) used_at_m_[id] = way_m;
}

}  // namespace perdure::mapping
