#include "common/mapping/loop_search.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <set>

#include "common/mapping/frames/level_errors.h"
#include "common/mapping/graph/components.h"
#include "common/math/gaussian.h"
#include "common/math/so3.h"

namespace perdure::mapping {
namespace {

/// Bound on the uncertainty from any anchor, relative to that from the component's first anchor.
constexpr double kFarther = 1.5;

/// A prior as wide as the map, for a body whose position on the map is unknown.
LevelGaussian anywhereOn(const MapIndex& map) {
  LevelGaussian prior;
  prior.mean.p << map.centre(), 0.0;
  constexpr double kBeyond_m = 20.0, kHeight_m = 1000.0, kTurns_rad = 10.0;
  prior.covariance.setZero();
  prior.covariance.diagonal() << map.spread2().array() + kBeyond_m * kBeyond_m,
      kHeight_m * kHeight_m, kTurns_rad * kTurns_rad;
  return prior;
}

AnchorId homeOf(const PlaceMatch& match, const std::map<ObjectId, AnchorId>& homes) {
  std::map<AnchorId, std::size_t> counts;
  for (const auto& [known, seen] : match.pairs) ++counts[homes.at(known)];
  return std::max_element(counts.begin(), counts.end(),
                          [](const auto& a, const auto& b) { return a.second < b.second; })
      ->first;
}

const PlacedObject& withId(const std::vector<PlacedObject>& objects, ObjectId id) {
  return *std::find_if(objects.begin(), objects.end(),
                       [id](const PlacedObject& o) { return o.id == id; });
}

/// Returns by how much the variance of T_ba exceeds that of the transform to the nearest anchor,
/// m². Relative positions of objects near the two anchors have this uncertainty.
double varianceBeyond(const LevelGaussian& T_ba, const LevelGaussian& nearest) {
  const double sigma = planeSigma(T_ba.covariance), least = planeSigma(nearest.covariance);
  return std::max(0.0, sigma * sigma - least * least);
}

/// Computes the match again from the objects of one visit, and sets `home`. An edge relates the
/// body to anchors of one visit. Objects of other visits affected the match by their relative
/// positions in M, which no object measured.
void restOnOneVisit(LoopSearch::Found& found, const std::vector<PlacedObject>& objects,
                    const std::map<ObjectId, AnchorId>& homes,
                    const std::vector<PlacedObject>& seen, const MapState& state, double visit_m) {
  const PlaceMatch& match = found.match;
  const auto informationOf = [&](AnchorId home) {
    double sum = 0.0;
    for (const auto& [known, as] : match.pairs) {
      if (!isOneVisit(state, homes.at(known), home, visit_m)) continue;
      sum += 1.0 / (planeVariance(withId(objects, known)) + planeVariance(withId(seen, as)));
    }
    return sum;
  };
  double most = 0.0;
  for (const auto& [known, as] : match.pairs) {
    const double information = informationOf(homes.at(known));
    if (information <= most) continue;
    most = information;
    found.home = homes.at(known);
  }
  MatchEquations equations;
  const LevelPose x = match.T_MB.mean;
  for (const auto& [known, as] : match.pairs) {
    if (!isOneVisit(state, homes.at(known), found.home, visit_m)) continue;
    equations.add(withId(seen, as), withId(objects, known), x);
  }
  const Eigen::Vector4d step = equations.stepNear(inverseSymmetric(found.prior->covariance),
                                                  difference(found.prior->mean, x));
  found.match.T_MB.mean = {x.p + step.head<3>(), wrapAngle(x.yaw + step[3])};
  found.match.T_MB.covariance = equations.covariance();
}

}  // namespace

bool isOneVisit(const MapState& state, AnchorId a, AnchorId b, double visit_m) {
  const Anchor &x = state.anchors().at(a), &y = state.anchors().at(b);
  return x.session == y.session && std::abs(x.way_m - y.way_m) < visit_m;
}

std::optional<LevelGaussian> Whereabouts::to(AnchorId anchor) const {
  auto T_ba = relative.to(anchor);
  if (T_ba) T_ba->covariance *= widening * widening;
  return T_ba;
}

bool Whereabouts::asks(AnchorId anchor) const {
  return !others_only || state.anchors().at(anchor).session != here().session;
}

bool Whereabouts::isOld(const ObjectRecord& record, double visit_m) const {
  return record.session != here().session || std::abs(way.way_m() - record.way_m) > visit_m;
}

/// Uses that the anchors of a session have consecutive ids.
std::vector<AnchorId> Whereabouts::anchorsOfVisit(double visit_m) const {
  std::vector<AnchorId> ids;
  const auto& all = state.anchors();
  const auto of_visit = [&](const Anchor& a) {
    return a.session == here().session && std::abs(way.way_m() - a.way_m) <= visit_m;
  };
  auto it = all.find(here().id);
  while (it != all.begin() && of_visit(std::prev(it)->second)) --it;
  for (; it != all.end() && of_visit(it->second); ++it) ids.push_back(it->first);
  return ids;
}

std::vector<ObjectId> Whereabouts::objectsOfVisit(double visit_m) const {
  std::vector<ObjectId> ids;
  // An object belongs to the last anchor before the position from which it was detected.
  constexpr double kAnchors_m = 15.0;
  for (const AnchorId anchor : anchorsOfVisit(visit_m + kAnchors_m)) {
    for (const ObjectId id : state.seenFrom(anchor)) {
      const ObjectRecord& record = state.records().at(id);
      if (record.sighting.anchor == anchor && !isOld(record, visit_m)) ids.push_back(id);
    }
  }
  std::sort(ids.begin(), ids.end());
  return ids;
}

const Sighting* sightingOfBefore(const ObjectRecord& record, const Whereabouts& body,
                                 double visit_m) {
  if (body.isOld(record, visit_m)) return &record.sighting;
  return record.earlier ? &*record.earlier : nullptr;
}

PlacedObject inM(const MapState& state, const Sighting& sighting) {
  return transformed(state.graph().pose(sighting.anchor), sighting.in_anchor);
}

LevelGaussian bodyByGraph(const Whereabouts& body, const LevelGaussian& T_ba) {
  const LevelPose T_Mb = body.state.graph().pose(body.here().id);
  return {T_Mb, turnedBy((T_Mb * T_ba.mean).R(), mapping::inverse(T_ba).covariance)};
}

std::vector<std::pair<double, AnchorId>> anchorsOfBefore(const Whereabouts& body,
                                                         const Parameters& parameters) {
  const PoseGraph& graph = body.state.graph();
  const Eigen::Vector3d here = graph.pose(body.here().id).p;
  const auto of_late = body.anchorsOfVisit(parameters.loop.visit_m);
  std::vector<std::pair<double, AnchorId>> anchors;
  for (const auto& [id, pose] : graph.poses()) {
    if ((id >= of_late.front() && id <= of_late.back()) || !body.asks(id)) continue;
    anchors.emplace_back((pose.p - here).head<2>().norm(), id);
  }
  const double far_m =
      parameters.loop.view_m + parameters.place.gate_sigmas * kFarther * body.deviation_m;
  std::erase_if(anchors, [&](const auto& a) { return a.first > far_m; });
  std::sort(anchors.begin(), anchors.end());
  return anchors;
}

/// Returns the objects detected on this visit, in the frame of the body's newest anchor. Leaves out
/// objects known from earlier visits. Returns nothing if none was detected within fresh_m.
std::vector<PlacedObject> LoopSearch::seenOfLate(const Whereabouts& body) const {
  std::vector<PlacedObject> seen;
  bool fresh = false;
  for (const ObjectId id : body.objectsOfVisit(parameters_.loop.visit_m)) {
    const ObjectRecord& record = body.state.records().at(id);
    const Sighting* before = record.earlier ? &*record.earlier : nullptr;
    if (before && body.asks(before->anchor) && body.to(before->anchor)) continue;
    const auto T_bA = body.to(record.sighting.anchor);
    if (!T_bA) continue;
    seen.push_back(laid(*T_bA, record.sighting.in_anchor));
    fresh = fresh || std::abs(body.way.way_m() - record.way_m) < parameters_.loop.fresh_m;
  }
  if (!fresh) seen.clear();
  return seen;
}

/// Confirmed objects whose last sighting before this visit belongs to the anchor.
std::set<ObjectId> LoopSearch::objectsSeenFrom(AnchorId anchor, const Whereabouts& body) const {
  std::set<ObjectId> ids;
  for (const ObjectId object : body.state.seenFrom(anchor)) {
    const ObjectRecord& record = body.state.records().at(object);
    const Sighting* known = sightingOfBefore(record, body, parameters_.loop.visit_m);
    if (record.confirmed && known != nullptr && known->anchor == anchor) ids.insert(object);
  }
  return ids;
}

LoopSearch::Around LoopSearch::mapAround(const Whereabouts& body) const {
  const LoopParameters& loop = parameters_.loop;
  Around around;
  double nearest_m = std::numeric_limits<double>::infinity();
  std::set<ObjectId> ids;
  for (const auto& [distance, id] : anchorsOfBefore(body, parameters_)) {
    const auto T_ba = body.to(id);
    if (!T_ba) continue;
    const double sigma = planeSigma(T_ba->covariance);
    if (distance > loop.view_m + parameters_.place.gate_sigmas * sigma) continue;
    around.driven.push_back(body.state.graph().pose(id).p.head<2>());
    if (distance - sigma < nearest_m) {
      nearest_m = distance - sigma;
      around.nearest = T_ba;
    }
    ids.merge(objectsSeenFrom(id, body));
  }
  for (const ObjectId id : ids) {
    const ObjectRecord& record = body.state.records().at(id);
    const Sighting& known = *sightingOfBefore(record, body, loop.visit_m);
    around.objects.push_back(inM(body.state, known));
    around.homes[known.in_anchor.id] = known.anchor;
    const double beyond = varianceBeyond(*body.to(known.anchor), *around.nearest);
    around.objects.back().covariance.diagonal().head<2>().array() += beyond;
  }
  return around;
}

std::optional<LoopSearch::Found> LoopSearch::nearby(const Whereabouts& body) const {
  const auto seen = seenOfLate(body);
  if (seen.empty()) return std::nullopt;
  Around around = mapAround(body);
  if (around.objects.empty()) return std::nullopt;
  const LevelGaussian& T_ba = *around.nearest;
  LevelGaussian prior = bodyByGraph(body, T_ba);
  addFloor(prior.covariance, parameters_.loop.floor_m, parameters_.loop.floor_rad);
  const double sigma_m = planeSigma(T_ba.covariance);
  const MapIndex index(std::move(around.objects), std::move(around.driven), parameters_.place);
  auto match = bestMatch(seen, index, prior, parameters_.place);
  if (!match) return std::nullopt;
  // A match far from the prior position means that the position was not known that well. The error
  // of the match is not added, because that of a wrong match is large.
  const LevelError off = difference(prior.mean, match->T_MB.mean);
  const bool far = squaredMahalanobis(off, prior.covariance) > parameters_.loop.far_chi2;
  if (!isBelieved(*match, far ? std::max(sigma_m, parameters_.loop.near_m) : sigma_m)) {
    return std::nullopt;
  }
  Found found{std::move(*match), 0, prior, sigma_m};
  restOnOneVisit(found, index.objects(), around.homes, seen, body.state, parameters_.loop.visit_m);
  return found;
}

/// Requires less evidence the better the body's position is known, because only the pairs of
/// objects can then be wrong.
bool LoopSearch::isBelieved(const PlaceMatch& match, double sigma_m) const {
  const LoopParameters& loop = parameters_.loop;
  const bool near = sigma_m < loop.near_m;
  const std::size_t least = near ? 1 : sigma_m < loop.far_m ? 2 : 4;
  const double nats = near ? loop.near_nats : loop.nats;
  return match.pairs.size() >= least && match.score - match.next >= nats + std::log(match.cells);
}

std::optional<LoopSearch::Found> LoopSearch::nearLast(const Whereabouts& body,
                                                      const LastPlace& last) const {
  auto seen = seenOfLate(body);
  const auto T_bF = body.to(last.begins);
  if (seen.size() < parameters_.loop.least_elsewhere || !T_bF) return std::nullopt;
  const LevelPose T_Fb = T_bF->mean.inverse();
  for (PlacedObject& object : seen) object = transformed(T_Fb, std::move(object));
  const auto components = componentsOf(body.state.graph());
  const Eigen::Vector2d place = last.T_MF.mean.p.head<2>();
  const double far_m = parameters_.loop.view_m + T_Fb.p.norm() +
                       parameters_.place.gate_sigmas * planeSigma(last.T_MF.covariance);
  std::vector<PlacedObject> objects;
  std::vector<Eigen::Vector2d> driven;
  std::map<ObjectId, AnchorId> homes;
  for (const auto& [id, pose] : body.state.graph().poses()) {
    if (components.at(id) != components.at(last.anchor)) continue;
    if ((pose.p.head<2>() - place).norm() > far_m) continue;
    driven.push_back(pose.p.head<2>());
    for (const ObjectId object : objectsSeenFrom(id, body)) {
      const ObjectRecord& record = body.state.records().at(object);
      const Sighting& known = *sightingOfBefore(record, body, parameters_.loop.visit_m);
      objects.push_back(inM(body.state, known));
      homes[known.in_anchor.id] = id;
    }
  }
  if (objects.empty()) return std::nullopt;
  const MapIndex index(std::move(objects), std::move(driven), parameters_.place);
  auto match = bestMatch(std::move(seen), index, last.T_MF, parameters_.place);
  if (!match || !isSureAtOnce(*match)) return std::nullopt;
  match->T_MB = compose(match->T_MB, {T_Fb, Eigen::Matrix4d::Zero()});
  const AnchorId home = homeOf(*match, homes);
  constexpr double kNowhere = std::numeric_limits<double>::infinity();
  return Found{std::move(*match), home, std::nullopt, kNowhere};
}

/// Returns whether one search suffices: the match has enough evidence against chance, given the
/// number of possible poses in the prior, and against the second-best pose.
bool LoopSearch::isSureAtOnce(const PlaceMatch& match) const {
  const LoopParameters& loop = parameters_.loop;
  return match.pairs.size() >= loop.least_elsewhere &&
         match.score >= loop.at_once_nats + std::log(match.cells) &&
         match.score - match.next >= loop.nats;
}

void LoopSearch::indexOthers(const Whereabouts& body) {
  const auto components = componentsOf(body.state.graph());
  const AnchorId own = components.at(body.here().id);
  std::map<AnchorId, std::vector<PlacedObject>> objects;
  std::map<AnchorId, std::vector<Eigen::Vector2d>> driven;
  for (const auto& [id, record] : body.state.records()) {
    if (!record.confirmed) continue;
    const Sighting* known = &record.sighting;
    if (components.at(known->anchor) == own && record.earlier) known = &*record.earlier;
    const AnchorId component = components.at(known->anchor);
    if (component == own) continue;
    objects[component].push_back(inM(body.state, *known));
    others_[component].homes[known->in_anchor.id] = known->anchor;
  }
  for (const auto& [anchor, component] : components) {
    if (component != own) driven[component].push_back(body.state.graph().pose(anchor).p.head<2>());
  }
  for (auto& [component, of_it] : objects) {
    others_[component].index = std::make_unique<MapIndex>(
        std::move(of_it), std::move(driven.at(component)), parameters_.place);
  }
}

std::optional<LoopSearch::Found> LoopSearch::elsewhere(const Whereabouts& body) {
  if (body.state.graph().components() < 2) return std::nullopt;
  const auto seen = seenOfLate(body);
  if (seen.size() < parameters_.loop.least_elsewhere) return std::nullopt;
  if (others_.empty()) indexOthers(body);
  constexpr double kNowhere = std::numeric_limits<double>::infinity();
  std::optional<Found> best;
  for (const auto& [component, other] : others_) {
    auto match = bestMatch(seen, *other.index, anywhereOn(*other.index), parameters_.place);
    if (!match) continue;
    // a match in another component is an alternative pose
    if (best) {
      match->next = std::max(match->next, best->match.score);
      best->match.next = std::max(best->match.next, match->score);
    }
    if (best && match->score <= best->match.score) continue;
    const AnchorId home = homeOf(*match, other.homes);
    best = Found{std::move(*match), home, std::nullopt, kNowhere};
  }
  if (!best || !isBelieved(best->match, kNowhere)) return std::nullopt;
  return best;
}

}  // namespace perdure::mapping
