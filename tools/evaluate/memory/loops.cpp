#include "tools/evaluate/memory/loops.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <tuple>

#include "common/base/algorithms/disjoint_sets.h"
#include "tools/base/quantile.h"
#include "tools/evaluate/trajectory_score.h"

namespace perdure::tools {
namespace {

using mapping::AnchorId;
using mapping::LevelPose;
using mapping::SavedMap;

std::optional<RigidTransform> trueLevel(const replay::PoseFile& truth, TimePoint time) {
  const auto T_WB = truth.at(0, time);
  if (!T_WB) return std::nullopt;
  return mapping::levelled(*T_WB, Eigen::Vector3d::UnitZ());
}

std::optional<JudgedLoop> judge(const mapping::SavedEdge& saved, const SavedMap& map,
                                const replay::PoseFile& truth, const LoopOptions& options) {
  const auto a = map.anchors.find(saved.edge.a), b = map.anchors.find(saved.edge.b);
  if (a == map.anchors.end() || b == map.anchors.end()) return std::nullopt;
  const TimePoint time_a = a->second.anchor.stamp.time, time_b = b->second.anchor.stamp.time;
  const auto T_WA = trueLevel(truth, time_a), T_WB = trueLevel(truth, time_b);
  if (!T_WA || !T_WB) return std::nullopt;
  const LevelPose true_T_ab = mapping::levelOf(T_WA->inverse() * *T_WB);
  const mapping::LevelError error = difference(saved.edge.T_ab.mean, true_T_ab);
  JudgedLoop loop;
  loop.kind = saved.edge.kind;
  std::tie(loop.from, loop.to) = std::minmax(time_a, time_b);
  loop.off_m = error.head<2>().norm();
  loop.off_rad = std::abs(error[3]);
  const Eigen::Vector2d along = error.head<2>().normalized();
  loop.sigma_m = std::sqrt(along.dot(saved.edge.T_ab.covariance.topLeftCorner<2, 2>() * along));
  loop.weight = saved.weight;
  loop.believed = saved.weight >= mapping::kBelieved;
  loop.wrong = loop.off_m > std::max(options.wrong_m, options.wrong_sigmas * loop.sigma_m) ||
               loop.off_rad > options.wrong_rad;
  return loop;
}

/// RMSE over all parts, each aligned separately.
double alignedError(const std::map<AnchorId, std::vector<PosePair>>& parts) {
  double squares = 0.0;
  std::size_t count = 0;
  for (const auto& [part, pairs] : parts) {
    if (pairs.size() < 2) continue;
    const RigidTransform T = align(pairs, Alignment::kYaw);
    for (const PosePair& pair : pairs)
      squares += (T * pair.estimate.p - pair.truth.p).squaredNorm();
    count += pairs.size();
  }
  return count == 0 ? 0.0 : std::sqrt(squares / static_cast<double>(count));
}

/// Returns, by frame, the visible objects that were also visible on an earlier visit.
std::map<std::size_t, std::set<std::uint64_t>> seenAgain(const std::vector<MemoryFrame>& frames,
                                                         const MemoryOptions& options) {
  std::map<std::size_t, std::set<std::uint64_t>> again;
  for (const auto& [object, visits] : visitsOf(frames, options)) {
    for (std::size_t i = 1; i < visits.size(); ++i) {
      for (const std::size_t frame : visits[i].frames) again[frame].insert(object);
    }
  }
  return again;
}

double wayAt(const std::vector<MemoryFrame>& frames, TimePoint time) {
  const auto after = std::ranges::lower_bound(frames, time, {}, &MemoryFrame::time);
  return after == frames.end() ? frames.back().way_m : after->way_m;
}

std::optional<double> closedAfter(const ReturnVisit& visit, const std::vector<MemoryFrame>& frames,
                                  const std::vector<JudgedLoop>& loops,
                                  const LoopOptions& options) {
  const double from = frames[visit.first].way_m, to = frames[visit.last].way_m;
  std::optional<double> first;
  for (const JudgedLoop& loop : loops) {
    if (!loop.believed || loop.wrong) continue;
    const double way = wayAt(frames, loop.to);
    if (way < from - options.anchor_m || way > to + options.anchor_m) continue;
    const double after = std::max(0.0, way - from);
    if (!first || after < *first) first = after;
  }
  return first;
}

template <class Predicate>
std::uint64_t countIf(const std::vector<JudgedLoop>& loops, const Predicate& predicate) {
  return static_cast<std::uint64_t>(std::ranges::count_if(loops, predicate));
}

}  // namespace

std::uint64_t LoopJudgement::believed() const {
  return countIf(loops, [](const JudgedLoop& loop) { return loop.believed; });
}
std::uint64_t LoopJudgement::wrong() const {
  return countIf(loops, [](const JudgedLoop& loop) { return loop.wrong; });
}
std::uint64_t LoopJudgement::wrongBelieved() const {
  return countIf(loops, [](const JudgedLoop& loop) { return loop.wrong && loop.believed; });
}

LoopJudgement judgeLoops(const SavedMap& map, const replay::PoseFile& truth,
                         const LoopOptions& options) {
  LoopJudgement result;
  for (const auto& [id, saved] : map.edges) {
    if (saved.edge.kind == mapping::EdgeKind::kOdometry) continue;
    auto loop = judge(saved, map, truth, options);
    if (!loop) {
      ++result.unjudged;
      continue;
    }
    loop->id = id;
    result.loops.push_back(*loop);
  }
  return result;
}

AnchorErrors scoreAnchors(const SavedMap& map, const replay::PoseFile& truth) {
  DisjointSets<AnchorId> sessions, joined;
  for (const auto& [id, saved] : map.edges) {
    const bool odometry = saved.edge.kind == mapping::EdgeKind::kOdometry;
    if (odometry || saved.weight >= mapping::kBelieved) joined.join(saved.edge.a, saved.edge.b);
  }
  for (const auto& [id, saved] : map.anchors) {
    if (!map.anchors.contains(saved.anchor.previous)) continue;
    sessions.join(saved.anchor.previous, id);
    joined.join(saved.anchor.previous, id);
  }
  AnchorErrors errors;
  std::map<AnchorId, LevelPose> chained;
  std::map<AnchorId, std::vector<PosePair>> by_odometry, by_map;
  for (const auto& [id, saved] : map.anchors) {
    const mapping::Anchor& anchor = saved.anchor;
    const auto before = chained.find(anchor.previous);
    const bool goes_on = before != chained.end();
    chained[id] = goes_on ? before->second * anchor.from_previous.mean : LevelPose{};
    const auto T_WA = trueLevel(truth, anchor.stamp.time);
    if (!T_WA) continue;
    ++errors.anchors;
    by_odometry[sessions.rootOf(id)].push_back({anchor.stamp.time, chained[id].rigid(), *T_WA});
    by_map[joined.rootOf(id)].push_back({anchor.stamp.time, saved.T_MA.rigid(), *T_WA});
  }
  errors.odometry_m = alignedError(by_odometry);
  errors.map_m = alignedError(by_map);
  return errors;
}

std::vector<ReturnVisit> returnVisits(const std::vector<MemoryFrame>& frames,
                                      const std::vector<JudgedLoop>& loops,
                                      const MemoryOptions& memory, const LoopOptions& options) {
  std::vector<ReturnVisit> visits;
  std::set<std::uint64_t> objects;
  const auto end = [&] {
    if (!visits.empty()) visits.back().objects = objects.size();
    objects.clear();
  };
  for (const auto& [frame, seen] : seenAgain(frames, memory)) {
    if (visits.empty() || frames[frame].way_m - frames[visits.back().last].way_m >= options.gap_m) {
      end();
      visits.push_back({frame, frame, 0, std::nullopt});
    }
    visits.back().last = frame;
    objects.insert(seen.begin(), seen.end());
  }
  end();
  std::erase_if(visits, [&](const ReturnVisit& v) { return v.objects < options.objects; });
  for (ReturnVisit& visit : visits) {
    visit.closed_after_m = closedAfter(visit, frames, loops, options);
  }
  return visits;
}

std::uint64_t LoopScore::missed() const {
  return static_cast<std::uint64_t>(std::ranges::count_if(
      returns, [](const ReturnVisit& visit) { return !visit.closed_after_m; }));
}

std::optional<double> LoopScore::wayToClose() const {
  std::vector<double> ways;
  for (const ReturnVisit& visit : returns) {
    if (visit.closed_after_m) ways.push_back(*visit.closed_after_m);
  }
  if (ways.empty()) return std::nullopt;
  return quantile(std::move(ways), 0.5);
}

LoopScore scoreLoops(const SavedMap& map, const replay::PoseFile& truth,
                     const std::vector<MemoryFrame>& frames, const MemoryOptions& memory,
                     const LoopOptions& options) {
  LoopScore score;
  score.judgement = judgeLoops(map, truth, options);
  score.anchors = scoreAnchors(map, truth);
  score.returns = returnVisits(frames, score.judgement.loops, memory, options);
  return score;
}

}  // namespace perdure::tools
