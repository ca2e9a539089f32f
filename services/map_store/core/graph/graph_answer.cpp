#include "services/map_store/core/graph/graph_answer.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "common/mapping/graph/components.h"

namespace perdure::map_store {
namespace {

using mapping::AnchorId;

constexpr std::size_t kLoopsPerAnchor = 8;

/// Returns the anchors within the query's radius, nearest first; `all` are those of a component.
std::vector<AnchorId> nearestAnchors(const mapping::PoseGraph& graph,
                                     const std::vector<AnchorId>& all, const MapQuery& query) {
  const double reach = query.radius > 0.0 ? query.radius : std::numeric_limits<double>::infinity();
  std::vector<std::pair<double, AnchorId>> by_distance;
  for (const AnchorId id : all) {
    const double distance = (graph.pose(id).p - query.low).norm();
    if (distance <= reach) by_distance.emplace_back(distance, id);
  }
  std::sort(by_distance.begin(), by_distance.end());
  std::vector<AnchorId> ids;
  for (const auto& [distance, id] : by_distance) ids.push_back(id);
  return ids;
}

/// Returns standard deviations; zeros, which mean unknown, if a variance is not finite or too
/// large.
Eigen::Vector4d sigmaOf(const Eigen::Vector4d& variances) {
  constexpr double kNothing = 1e8;  // (10 km)², in m²
  const bool known = (variances.array() >= 0.0).all() && (variances.array() < kNothing).all();
  return known ? variances.cwiseSqrt().eval() : Eigen::Vector4d::Zero().eval();
}

MapLoop loopOf(const mapping::PoseGraph& graph, std::uint64_t id, const mapping::Edge& edge) {
  MapLoop loop;
  loop.id = id;
  loop.a = edge.a;
  loop.b = edge.b;
  loop.kind = edge.kind == mapping::EdgeKind::kTracking ? MapLoopKind::kTie : MapLoopKind::kLoop;
  loop.residual =
      mapping::difference(edge.T_ab.mean, graph.pose(edge.a).inverse() * graph.pose(edge.b));
  loop.sigma = sigmaOf(edge.T_ab.covariance.diagonal());
  loop.chi2 = graph.chi2(edge);
  return loop;
}

void putPairs(const std::vector<std::pair<ObjectId, ObjectId>>& pairs, std::size_t points,
              MapLoop& loop) {
  for (const auto& [known, seen] : pairs) loop.pairs.push_back({known, seen});
  loop.landmarks = static_cast<std::uint32_t>(points);
}

/// Returns the loop closures of a component, ordered by id.
std::vector<MapLoop> loopsOf(const mapping::Mapper& mapper,
                             const std::vector<mapping::LoopWithdrawal>& withdrawn,
                             const std::map<AnchorId, AnchorId>& components, AnchorId component) {
  const auto is_here = [&](const mapping::Edge& edge) {
    const auto a = components.find(edge.a), b = components.find(edge.b);
    return a != components.end() && b != components.end() && a->second == component &&
           b->second == component;
  };
  std::map<std::uint64_t, MapLoop> loops;
  for (const mapping::LoopWithdrawal& gone : withdrawn) {
    if (!is_here(gone.edge)) continue;
    MapLoop& loop = loops[gone.id] = loopOf(mapper.graph(), gone.id, gone.edge);
    loop.state = MapLoopState::kWithdrawn;
    putPairs(gone.pairs, gone.points, loop);
  }
  for (const mapping::Mapper::Loop& known : mapper.loops()) {
    if (!is_here(known.edge)) continue;
    MapLoop& loop = loops[known.id] = loopOf(mapper.graph(), known.id, known.edge);
    const bool told = known.told || loop.kind == MapLoopKind::kTie;
    loop.weight = known.weight;
    if (told && known.weight >= mapping::kBelieved) loop.state = MapLoopState::kConfirmed;
    putPairs(known.pairs, known.points, loop);
  }
  std::vector<MapLoop> result;
  for (auto& [id, loop] : loops) result.push_back(std::move(loop));
  return result;
}

}  // namespace

void putGraph(mapping::Mapper& mapper, const std::vector<mapping::LoopWithdrawal>& withdrawn,
              const WorldId& session, const MapQuery& query, MapReply& reply) {
  const auto newest = mapper.newestAnchor(session);
  if (!newest) return;
  const auto components = mapping::componentsOf(mapper.graph());
  const AnchorId first = components.at(*newest);
  std::vector<AnchorId> all;
  for (const auto& [id, component] : components) {
    if (component == first) all.push_back(id);
  }
  std::vector<AnchorId> told = nearestAnchors(mapper.graph(), all, query);
  const std::size_t most = std::min(query.limit, kMostAnchors);
  reply.truncated = told.size() > most;
  told.resize(std::min(told.size(), most));
  std::sort(told.begin(), told.end());

  const auto variances = mapper.variances();
  const WorldId map = mapper.anchors().at(first).session;
  for (const AnchorId id : told) {
    const mapping::Anchor& anchor = mapper.anchors().at(id);
    const mapping::LevelPose& pose = mapper.graph().pose(id);
    const auto known = variances.find(id);
    reply.anchors.push_back(
        {id, anchor.previous, anchor.session, map, pose.p, pose.yaw,
         known == variances.end() ? Eigen::Vector4d::Zero().eval() : sigmaOf(known->second),
         static_cast<std::uint32_t>(mapper.objectsOf(id))});
  }
  auto loops = loopsOf(mapper, withdrawn, components, first);
  reply.anchor_count = static_cast<std::uint32_t>(all.size());
  reply.loop_count = static_cast<std::uint32_t>(loops.size());
  std::erase_if(loops, [&](const MapLoop& loop) {
    return !std::binary_search(told.begin(), told.end(), loop.a) ||
           !std::binary_search(told.begin(), told.end(), loop.b);
  });
  const std::size_t most_loops = kLoopsPerAnchor * most;
  if (loops.size() > most_loops) {
    reply.truncated = true;
    loops.erase(loops.begin(), loops.end() - static_cast<std::ptrdiff_t>(most_loops));
  }
  reply.loops = std::move(loops);
}

}  // namespace perdure::map_store
