// Loop closures of the mapper: search, acceptance and retraction.
#include <algorithm>
#include <cmath>

#include "common/mapping/frames/level_errors.h"
#include "common/mapping/graph/components.h"
#include "common/mapping/mapper.h"
#include "common/math/so3.h"

namespace perdure::mapping {
namespace {

std::set<std::pair<ObjectId, ObjectId>> pairsOf(const PlaceMatch& match) {
  return {match.pairs.begin(), match.pairs.end()};
}

}  // namespace

/// Adds an edge if objects that were detected again under their old ids reduce the uncertainty.
void Mapper::tie() {
  const auto tie = tracked_ties_.find(body());
  if (!tie) return;
  tracked_ties_.use(*tie, builder_.way_m());
  const Edge edge = edgeFrom(tie->home, builder_.last()->id, tie->T_Mb, EdgeKind::kTracking);
  const double chi2 = state_.graph().chi2(edge);
  state_.addLoop(edge);
  marginals_.reset();
  constexpr double kAgrees = 4.0;  // χ² up to which the tie waits for the next optimisation
  if (chi2 > kAgrees) graphMoved();
}

void Mapper::graphMoved() {
  state_.optimise();
  settle();
  marginals_.reset();
  loop_search_.forget();
  ++revision_;
}

/// Reports loop closures that the graph accepts now, and removes those that it has rejected for
/// some distance.
void Mapper::settle() {
  const LoopBook::Verdict verdict = loop_book_.judge(state_.graph(), builder_.way_m());
  for (const EdgeId id : verdict.given_up) {
    if (!state_.identity().factsOf(id).empty()) {  // it replaced an accepted one
      withdraw(id);
      continue;
    }
    state_.removeLoop(id);
    loop_book_.remove(id);
  }
  for (const EdgeId id : verdict.withdrawn) withdraw(id);
  if (!verdict.given_up.empty() || !verdict.withdrawn.empty()) {
    learnDrift();
    state_.optimise();
  }
  for (const LoopClosure& loop : verdict.told) {
    change_.loops.push_back(loop);
    join(loop);
  }
}

/// Adds a fact for each pair of the loop closure: both tracks are one object.
void Mapper::join(const LoopClosure& loop) {
  const Identity& identity = state_.identity();
  for (const auto& [known, seen] : loop.match.pairs) {
    const ObjectRecord *of_known = state_.recordOfTrack(known),
                       *of_seen = state_.recordOfTrack(seen);
    const bool both = of_known && of_seen && !of_known->gone && !of_seen->gone;
    if (known == seen || !both) continue;  // a track may have ended since the search
    const auto [survivor, absorbed] =
        std::minmax({identity.objectOf(known), identity.objectOf(seen)});
    const SameObject fact{loop.id, known, seen};
    state_.unite(fact);
    change_.facts.push_back(fact);
    const bool joined = identity.objectOf(known) == identity.objectOf(seen);  // people may object
    if (survivor != absorbed && joined) change_.merges.push_back({loop.id, survivor, absorbed});
  }
}

void Mapper::withdraw(EdgeId loop) {
  const Edge& edge = state_.graph().edges().at(loop);
  LoopWithdrawal withdrawal{loop, edge.a, edge.b, edge};
  putWitnesses(loop, withdrawal.pairs, withdrawal.points);
  change_.withdrawn.push_back(std::move(withdrawal));
  const auto facts = state_.identity().factsOf(loop);
  state_.removeLoop(loop);
  loop_book_.remove(loop);
  for (const SameObject& fact : facts) {
    const auto [survivor, absorbed] =
        std::minmax({state_.identity().objectOf(fact.a), state_.identity().objectOf(fact.b)});
    if (survivor != absorbed) change_.splits.push_back({loop, survivor, absorbed});
  }
  if (active_ && active_->id == loop) active_.reset();
}

/// Returns the present view in the axes of the newest anchor; in a replay, the anchor's stored
/// view.
View Mapper::viewOfNow() const {
  constexpr double kBack_m = 15.0;
  const Anchor& here = *builder_.last();
  if (replays_) return state_.viewFrom(here.id);
  return view_builder_.viewFrom(here.T_WA, builder_.way_m(), kBack_m);
}

/// Whether the match and the newest loop closure have a pair in common.
bool Mapper::restsOnActive(const PlaceMatch& match) const {
  return active_ && std::any_of(match.pairs.begin(), match.pairs.end(),
                                [&](const auto& pair) { return active_->pairs.contains(pair); });
}

/// Searches with the uncertainty of an odometry that is less accurate than declared. A second
/// search must confirm the match by kOthers other pairs: with fewer, a wrong loop remained in one
/// of 16 towns (drift_scale.md, "Use").
std::optional<LoopSearch::Found> Mapper::searchWidely(const Whereabouts& here) {
  constexpr double kWider = 1.5;
  constexpr std::size_t kOthers = 3;  // pairs
  const double since_m = builder_.way_m() - searched_widely_at_m_;
  if (widening_ < kWider || since_m < parameters_.loop.elsewhere_each_m) return std::nullopt;
  searched_widely_at_m_ = builder_.way_m();
  auto found = loop_search_.nearby(body(widening_));
  // A match with pairs of the active loop would only measure this loop again, less accurately.
  if (!found || restsOnActive(found->match) ||
      view_search_.contradicts(*found, here, viewOfNow()) ||
      !isAgreedOn(*found, tentative_widely_, kOthers)) {
    return std::nullopt;
  }
  return found;
}

/// Searches by objects. If that gives no match, searches by objects in a wider region, and then,
/// once for each anchor, by appearance.
std::optional<LoopSearch::Found> Mapper::searchNearby(const Whereabouts& here, bool new_view) {
  auto found = loop_search_.nearby(here);
  if (found && view_search_.contradicts(*found, here, viewOfNow())) return std::nullopt;
  if (!found) found = searchWidely(here);
  if (!found && new_view) found = view_search_.nearby(here, viewOfNow());
  return found;
}

std::optional<LoopSearch::Found> Mapper::searchElsewhere(const Whereabouts& here, bool new_view) {
  std::optional<LoopSearch::Found> found;
  if (const auto last = lastPlace()) found = loop_search_.nearLast(here, *last);
  if (found && !view_search_.contradicts(*found, here, viewOfNow())) return found;
  found.reset();
  if (builder_.way_m() - searched_elsewhere_at_m_ >= parameters_.loop.elsewhere_each_m) {
    searched_elsewhere_at_m_ = builder_.way_m();
    found = loop_search_.elsewhere(here);
  }
  if (found && view_search_.contradicts(*found, here, viewOfNow())) return std::nullopt;
  if (!found && new_view) found = view_search_.elsewhere(here, viewOfNow());
  return found && isAgreedOn(*found, tentative_elsewhere_, 0) ? found : std::nullopt;
}

/// Searches the connected part of the map first. Searches the other components less often.
void Mapper::search() {
  const Whereabouts here = body();
  const AnchorId newest = builder_.last()->id;
  const bool new_view = std::exchange(looked_from_, newest) != newest;
  auto found = searchNearby(here, new_view);
  if (!found) found = searchElsewhere(here, new_view);
  if (!found) return;
  const bool by_objects = !found->match.pairs.empty();
  if (by_objects && active_ && active_->pairs == pairsOf(found->match)) return;  // no new pair
  close(*found);
}

/// Estimates the scale of the session's odometry errors from its loops. Applies the scale except in
/// a replay.
void Mapper::learnDrift() {
  std::vector<Anchor> way;
  for (const auto& [id, anchor] : state_.anchors()) {
    if (anchor.session == session_) way.push_back(anchor);
  }
  std::vector<Edge> loops;
  for (const auto& [id, edge] : state_.graph().edges()) {
    if (edge.kind != EdgeKind::kLoop || state_.graph().weight(id) < kBelieved) continue;
    loops.push_back(edge);
  }
  DriftScale drift(parameters_.drift_scale, way);
  const bool learned = drift.use(loops, parameters_.loop.view_m);
  if (!replays_) {
    odometry_variance_ =
        learned ? drift.variance(parameters_.drift_scale.quantile) : DriftVariance();
    state_.scaleOdometry(odometry_variance_, *session_);
  }
  const DriftVariance most = drift.variance(parameters_.drift_scale.most);
  widening_ = std::sqrt(most.over(odometry_variance_).plane);
  learned_at_m_ = builder_.way_m();
}

/// Returns whether an earlier search gave the same pose, because one search may find a similar,
/// wrong street. The two searches must be some distance apart, and at least `other_pairs` pairs
/// must be absent from the first. Otherwise stores `found` in `before`.
bool Mapper::isAgreedOn(const LoopSearch::Found& found, std::optional<Tentative>& before,
                        std::size_t other_pairs) const {
  constexpr double kSame_m = 3.0, kSame_rad = 0.1;
  const LoopParameters& loop = parameters_.loop;
  const LevelPose T_Nb = state_.graph().pose(builder_.last()->id);
  const AnchorId component = componentsOf(state_.graph()).at(found.home);
  if (before && before->component == component) {
    const double apart_m = builder_.way_m() - before->way_m;
    const LevelError d = difference(before->T_MN * T_Nb, found.match.T_MB.mean);
    const bool same = d.head<2>().norm() < kSame_m && std::abs(d[3]) < kSame_rad;
    if (same && apart_m < loop.agree_within_m) {
      const auto& known = before->pairs;
      const auto others = std::ranges::count_if(found.match.pairs, [&](const auto& pair) {
        return std::ranges::none_of(known, [&](const auto& earlier) {
          return earlier.first == pair.first || earlier.second == pair.second;
        });
      });
      return apart_m >= loop.agree_after_m && static_cast<std::size_t>(others) >= other_pairs;
    }
  }
  before = {found.match.T_MB.mean * T_Nb.inverse(), component, builder_.way_m(),
            pairsOf(found.match)};
  return false;
}

void Mapper::close(const LoopSearch::Found& found) {
  const PlaceMatch& match = found.match;
  const AnchorId a = found.home, b = builder_.last()->id;
  const Edge edge = edgeFrom(a, b, match.T_MB, EdgeKind::kLoop);
  const LevelPose before = state_.graph().pose(b);
  const auto old = restsOnActive(match) ? std::optional(active_->id) : std::nullopt;
  if (old) loop_book_.remove(*old);
  if (!found.prior) {
    bringTogether(edge);
    ended_.reset();
  }
  const EdgeId id = state_.addLoop(edge);
  if (old) {
    state_.replaceLoop(*old, id);
    state_.removeLoop(*old);
  }
  if (!match.pairs.empty()) active_ = {id, pairsOf(match)};
  loop_book_.add({id, a, b, match, !found.prior, 0.0}, before, builder_.way_m());
  tentative_widely_.reset();
  if (builder_.way_m() - learned_at_m_ >= parameters_.loop.elsewhere_each_m) learnDrift();
  graphMoved();
}

/// Moves the younger of the two components that the edge connects into the M of the older one.
void Mapper::bringTogether(const Edge& edge) {
  const auto components = componentsOf(state_.graph());
  const bool b_is_younger = components.at(edge.b) > components.at(edge.a);
  const AnchorId younger = components.at(b_is_younger ? edge.b : edge.a);
  const LevelPose& T_Ma = state_.graph().pose(edge.a);
  const LevelPose& T_Nb = state_.graph().pose(edge.b);
  const LevelPose T_MN = T_Ma * edge.T_ab.mean * T_Nb.inverse();
  std::set<AnchorId> moving;
  for (const auto& [anchor, component] : components) {
    if (component == younger) moving.insert(anchor);
  }
  state_.move(moving, b_is_younger ? T_MN : T_MN.inverse());
}

/// Converts a measured T_Mb to an edge. The error of a in M is not part of the edge's error.
Edge Mapper::edgeFrom(AnchorId a, AnchorId b, const LevelGaussian& T_Mb, EdgeKind kind) const {
  Edge edge{a, b, {}, kind};
  const LevelPose T_Ma = state_.graph().pose(a);
  edge.T_ab.mean = T_Ma.inverse() * T_Mb.mean;
  edge.T_ab.covariance = turnedBy(T_Ma.R().transpose(), T_Mb.covariance);
  addFloor(edge.T_ab.covariance, parameters_.loop.floor_m, parameters_.loop.floor_rad);
  return edge;
}

}  // namespace perdure::mapping
