#include "common/mapping/fusion/united_map.h"

#include <gtest/gtest.h>

#include "tests/common/mapping/fusion/drives.h"

namespace perdure::mapping {
namespace {

using test::Driven;

const std::vector<test::Thing>& allThings() {
  static const auto all = test::thingsAlongBlock(2);
  return all;
}

TEST(UnitedMap, RenumbersWhatCollidesAndSaysWhatItWas) {
  const Driven a = test::driven(allThings(), {.seed = 1, .to_m = 120.0});
  const Driven b = test::driven(allThings(), {.seed = 2, .from_m = 200.0, .to_m = 320.0});
  MapContents map = a.map;
  const Addition addition = unite(map, b.map);
  ASSERT_EQ(addition.sessions.size(), 1u);
  EXPECT_EQ(addition.sessions.front(), (WorldId{2, 0})) << "the next world that is free";
  EXPECT_EQ(addition.objects.size(), b.map.objects.size());
  EXPECT_EQ(map.objects.size(), a.map.objects.size() + b.map.objects.size());
  EXPECT_EQ(map.graph.anchors.size(), a.map.graph.anchors.size() + b.map.graph.anchors.size());
  EXPECT_EQ(map.origins.size(), b.map.objects.size());
  const SessionIdentity root = sessionsOf(b.map.graph).front().identity;
  for (const Origin& origin : map.origins) {
    EXPECT_EQ(origin.map, root);
    const StoredObject& now = map.objects.at(origin.now);
    const StoredObject& was = b.map.objects.at(origin.id);
    EXPECT_EQ(now.belief.id, origin.now);
    EXPECT_EQ(now.world, (WorldId{2, 0}));
    EXPECT_EQ(now.belief.best().mean, was.belief.best().mean);
    const ObjectRecord& record = map.graph.records.at(origin.now);
    EXPECT_EQ(map.graph.anchors.at(record.sighting.anchor).anchor.session, (WorldId{2, 0}));
    const auto& number = record.sighting.in_anchor.pmf.front().name;
    EXPECT_EQ(map.graph.classes.at(number), was.belief.best().name);
  }
  for (const auto& [id, saved] : map.graph.anchors) {
    EXPECT_EQ(saved.anchor.id, id);
    const AnchorId previous = saved.anchor.previous;
    if (previous == 0) continue;
    EXPECT_EQ(previous, id - 1);
    EXPECT_EQ(map.graph.anchors.at(previous).anchor.session, saved.anchor.session);
  }
}

TEST(UnitedMap, KeepsIdsAndWorldsThatAreFree) {
  const Driven a = test::driven(allThings(), {.seed = 1, .to_m = 100.0});
  Driven b = test::driven(allThings(), {.seed = 2, .from_m = 200.0, .to_m = 300.0, .world = {7, 2}});
  MapContents apart = b.map;
  apart.objects.clear();
  apart.graph.records.clear();
  constexpr ObjectId kFar = 1000;
  for (const auto& [id, object] : b.map.objects) {
    apart.objects[id + kFar] = object;
    apart.objects[id + kFar].belief.id = id + kFar;
  }
  MapContents map = a.map;
  const Addition addition = unite(map, apart);
  EXPECT_EQ(addition.sessions.front(), (WorldId{7, 2}));
  for (const auto& [id, object] : apart.objects) EXPECT_TRUE(map.objects.contains(id)) << id;
}

TEST(UnitedMap, ASessionThatIsKnownIsNotAddedAgain) {
  const Driven a = test::driven(allThings(), {.seed = 1, .to_m = 150.0});
  const Driven b = test::driven(allThings(), {.seed = 2, .from_m = 200.0, .to_m = 320.0});
  MapContents map = a.map;
  (void)unite(map, b.map);
  const MapContents once = map;
  for (const MapContents& again : {a.map, b.map, once}) {
    const Addition addition = unite(map, again);
    EXPECT_TRUE(addition.sessions.empty() && addition.grown.empty() && addition.objects.empty() &&
                addition.renewed.empty());
    EXPECT_EQ(map.objects.size(), once.objects.size());
    EXPECT_EQ(map.graph.anchors.size(), once.graph.anchors.size());
    EXPECT_EQ(map.graph.edges.size(), once.graph.edges.size());
    EXPECT_EQ(map.origins, once.origins);
  }
}

TEST(UnitedMap, WhereASessionGoesOnItsAnchorsStillFollowEachOther) {
  test::Vehicle vehicle(allThings(), {.seed = 1});
  const Driven a = vehicle.to(100.0), later = vehicle.to(200.0);
  const Driven b = test::driven(allThings(), {.seed = 2, .from_m = 200.0, .to_m = 320.0});
  MapContents map = a.map;
  (void)unite(map, b.map);
  const Addition addition = unite(map, later.map);
  EXPECT_EQ(addition.grown, std::vector<WorldId>{(WorldId{1, 0})});
  EXPECT_FALSE(addition.renewed.empty());
  const auto sessions = sessionsOf(map.graph);
  ASSERT_EQ(sessions.size(), 2u);
  EXPECT_EQ(sessions[0].anchors.size(), later.map.graph.anchors.size());
  for (const Session& session : sessions) {
    for (std::size_t k = 1; k < session.anchors.size(); ++k) {
      EXPECT_EQ(session.anchors[k], session.anchors[k - 1] + 1);
      const SavedAnchor& saved = map.graph.anchors.at(session.anchors[k]);
      EXPECT_EQ(saved.anchor.previous, session.anchors[k - 1]);
      const LevelPose expected =
          map.graph.anchors.at(saved.anchor.previous).T_MA * saved.anchor.from_previous.mean;
      EXPECT_LT(difference(saved.T_MA, expected).norm(), 1e-9) << "where its odometry puts it";
    }
  }
}

/// Two vehicles continued from copies of one map and gave the same ids to different objects.
TEST(UnitedMap, IdsThatWereGivenAfterTwoMapsPartedAreOfDifferentObjects) {
  test::Vehicle vehicle(allThings(), {.seed = 1});
  const Driven base = vehicle.to(100.0);
  const auto wentOn = [&](std::uint32_t seed, double from_m) {
    MapContents map = base.map;
    const Driven drive = test::driven(
        allThings(), {.seed = seed, .from_m = from_m, .to_m = from_m + 100.0, .clock_s = 50.0});
    MapContents renumbered = drive.map;
    (void)unite(map, renumbered);
    map.origins.clear();  // ids as a filter with this map would have given them
    return map;
  };
  MapContents one = wentOn(2, 200.0);
  const MapContents two = wentOn(3, 400.0);
  const std::size_t before = one.objects.size();
  const Addition addition = unite(one, two);
  EXPECT_EQ(addition.sessions.size(), 1u);
  EXPECT_EQ(addition.known, 1u);
  EXPECT_EQ(addition.objects.size(), two.objects.size() - base.map.objects.size());
  EXPECT_EQ(one.objects.size(), before + addition.objects.size());
}

}  // namespace
}  // namespace perdure::mapping
