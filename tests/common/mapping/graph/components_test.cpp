#include "common/mapping/graph/components.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>
#include <vector>

namespace perdure::mapping {
namespace {

const LevelGaussian kForward{{{12.0, 0.0, 0.0}, 0.0}, 0.01 * Eigen::Matrix4d::Identity()};

Edge loopOf(AnchorId a, AnchorId b) { return {a, b, kForward, EdgeKind::kLoop}; }

/// Finds components by a walk along accepted edges from each anchor.
std::map<AnchorId, AnchorId> walked(const PoseGraph& graph) {
  std::map<AnchorId, AnchorId> first;
  for (const auto& [begin, pose] : graph.poses()) {
    std::set<AnchorId> reached{begin};
    std::vector<AnchorId> todo{begin};
    while (!todo.empty()) {
      const AnchorId at = todo.back();
      todo.pop_back();
      for (const auto& [id, edge] : graph.edges()) {
        if (graph.weight(id) < kBelieved || (edge.a != at && edge.b != at)) continue;
        const AnchorId other = edge.a == at ? edge.b : edge.a;
        if (reached.insert(other).second) todo.push_back(other);
      }
    }
    first[begin] = *reached.begin();
  }
  return first;
}

TEST(Components, AreThoseThatOneCanWalk) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> any(0.0, 1.0);
  std::size_t most = 0, least = 1000;
  for (int round = 0; round < 60; ++round) {
    PoseGraph graph{{}};
    AnchorId id = 0;
    const std::size_t sessions = 1 + random() % 8;
    for (std::size_t s = 0; s < sessions; ++s) {
      graph.addFirst(++id, {});
      for (std::size_t k = random() % 6; k > 0; --k, ++id) graph.add(id + 1, id, kForward);
    }
    EdgeId edge = 1000;
    for (std::size_t k = random() % 7; k > 0; --k) {
      const AnchorId a = 1 + random() % id, b = 1 + random() % id;
      // Weights on both sides of the limit for acceptance.
      if (a != b) graph.restore(++edge, loopOf(a, b), any(random) < 0.5 ? 0.299 : 0.3);
    }
    const auto found = componentsOf(graph);
    EXPECT_EQ(found, walked(graph)) << round;
    std::set<AnchorId> firsts;
    for (const auto& [anchor, first] : found) firsts.insert(first);
    most = std::max(most, firsts.size());
    least = std::min(least, firsts.size());
  }
  EXPECT_EQ(least, 1u);
  EXPECT_GE(most, 6u);
}

TEST(Components, AreNamedByTheirOldestAnchorWhicheverWayTheEdgesLead) {
  PoseGraph graph{{}};
  for (const AnchorId id : {5, 9, 2, 30}) graph.addFirst(id, {});
  graph.add(loopOf(30, 9));
  graph.add(loopOf(9, 5));
  EXPECT_EQ(componentsOf(graph), (std::map<AnchorId, AnchorId>{{2, 2}, {5, 5}, {9, 5}, {30, 5}}));
  graph.add(loopOf(2, 30));
  for (const auto& [id, first] : componentsOf(graph)) EXPECT_EQ(first, 2u) << id;
}

TEST(Components, OfAnEmptyGraphAreNone) { EXPECT_TRUE(componentsOf(PoseGraph({})).empty()); }

}  // namespace
}  // namespace perdure::mapping
