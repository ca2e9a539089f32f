// Two maps are combined: a session is replayed on the map that it did not have.
#include <gtest/gtest.h>

#include <set>

#include "common/mapping/graph/components.h"
#include "tests/common/mapping/synthetic_drive.h"

namespace perdure::mapping {
namespace {

using namespace test;

/// Combines two independent maps. The ids of their objects differ already.
SavedMap together(SavedMap older, const SavedMap& younger) {
  const AnchorId shift = older.anchors.rbegin()->first;
  const EdgeId edge_shift = older.edges.empty() ? 0 : older.edges.rbegin()->first;
  std::vector<std::uint32_t> numbers;
  for (const std::string& name : younger.classes) {
    const auto at = std::find(older.classes.begin(), older.classes.end(), name);
    numbers.push_back(static_cast<std::uint32_t>(at - older.classes.begin()));
    if (at == older.classes.end()) older.classes.push_back(name);
  }
  for (auto [id, saved] : younger.anchors) {
    saved.anchor.id += shift;
    if (saved.anchor.previous != 0) saved.anchor.previous += shift;
    older.anchors[id + shift] = saved;
  }
  for (auto [id, saved] : younger.edges) {
    saved.edge.a += shift;
    saved.edge.b += shift;
    older.edges[id + edge_shift] = saved;
  }
  const auto moved = [&](Sighting& sighting) {
    sighting.anchor += shift;
    for (ClassShare& share : sighting.in_anchor.pmf) share.name = numbers.at(share.name);
  };
  const auto add = [&](const std::map<ObjectId, ObjectRecord>& from,
                       std::map<ObjectId, ObjectRecord>& to) {
    for (auto [id, record] : from) {
      moved(record.sighting);
      if (record.earlier) moved(*record.earlier);
      EXPECT_TRUE(to.emplace(id, record).second) << id;
    }
  };
  add(younger.records, older.records);
  add(younger.tracks, older.tracks);
  for (const SameObject& fact : younger.facts) {
    older.facts.insert({fact.loop == 0 ? 0 : fact.loop + edge_shift, fact.a, fact.b});
  }
  return older;
}

class Replay : public ::testing::Test {
 protected:
  static Settings first() {
    return {.seed = 3, .yaw_walk = 0.0005, .way_m = 1.1 * kLap_m, .world = {1, 0}};
  }
  static Settings second() {
    return {.seed = 3,
            .yaw_walk = 0.0005,
            .way_m = 260.0,
            .noise = 31,
            .world = {2, 0},
            .from_m = 150.0,
            .T_WB = {{40.0, 700.0, -3.0}, 2.0}};
  }

  Replay() : one_(first()) {
    one_.toTheEnd();
    // Archive of the second vehicle, which has no map of the first vehicle.
    auto archive = std::make_shared<Archive>();
    archive->next_id = one_.archive()->next_id;
    alone_ = std::make_unique<Drive>(second(), SavedMap(), archive);
    alone_->toTheEnd();
  }

  Drive one_;
  std::unique_ptr<Drive> alone_;
};

TEST_F(Replay, OfASessionGivesTheComponentThatDrivingItGives) {
  Drive driven(second(), one_);
  driven.toTheEnd();
  Mapper mapper(Drive::parametersOf(second()), together(one_.whole(), alone_->whole()));
  mapper.replay({2, 0});
  const MapChange change = mapper.takeChange();
  ASSERT_FALSE(change.loops.empty());
  EXPECT_EQ(std::count_if(change.loops.begin(), change.loops.end(),
                          [](const auto& loop) { return loop.joins; }),
            1);
  std::set<AnchorId> firsts;
  for (const auto& [id, of] : componentsOf(mapper.graph())) firsts.insert(of);
  EXPECT_EQ(firsts.size(), 1u);
  EXPECT_EQ(mapper.frame()->map, (WorldId{1, 0}));
  EXPECT_TRUE(mapper.follows({2, 0})) << "it stands at the session's end";

  // The replay has the same anchors as the drive.
  ASSERT_EQ(mapper.anchors().size(), driven.mapper().anchors().size());
  for (const auto& [id, anchor] : driven.mapper().anchors()) {
    const LevelError off = difference(mapper.graph().pose(id), driven.mapper().graph().pose(id));
    EXPECT_LT(off.head<2>().norm(), 0.5) << id;
    EXPECT_LT(std::abs(off[3]), 0.02) << id;
    if (anchor.session != second().world) continue;
    const LevelPose truth = onLap(second().from_m + anchor.way_m);
    EXPECT_LT((mapper.graph().pose(id).p - truth.p).head<2>().norm(), 1.5) << id;
  }

  // Merged objects are the same true object.
  std::size_t right = 0;
  const auto thingOf = [&](ObjectId id) {
    return one_.things().contains(id) ? one_.things().at(id) : alone_->things().at(id);
  };
  for (const MergeOrder& merge : change.merges) {
    EXPECT_LT(merge.survivor, merge.absorbed);
    EXPECT_EQ(thingOf(merge.survivor), thingOf(merge.absorbed));
    right += thingOf(merge.survivor) == thingOf(merge.absorbed) ? 1u : 0u;
  }
  EXPECT_GE(right, 8u);
}

TEST_F(Replay, LearnsNoScaleAnew) {
  const SavedMap both = together(one_.whole(), alone_->whole());
  Mapper mapper(Drive::parametersOf(second()), both);
  mapper.replay({2, 0});
  for (const auto& [id, anchor] : mapper.anchors()) {
    EXPECT_EQ(anchor.from_previous.covariance, both.anchors.at(id).anchor.from_previous.covariance)
        << id;
  }
}

TEST_F(Replay, OfWhatIsNotThereChangesNothing) {
  Mapper mapper(Drive::parametersOf(first()), one_.whole());
  mapper.replay({9, 0});
  EXPECT_TRUE(isEmpty(mapper.unsaved()));
  EXPECT_TRUE(mapper.takeChange().loops.empty());
  EXPECT_FALSE(mapper.follows({9, 0}));
}

}  // namespace
}  // namespace perdure::mapping
