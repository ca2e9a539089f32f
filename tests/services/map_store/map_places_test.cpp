#include "services/map_store/core/map_places.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "common/math/so3.h"

namespace perdure::map_store {
namespace {

using mapping::AnchorId;
using mapping::LevelPose;
using mapping::MapFrames;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::Pair;

const WorldId kSession{7, 0}, kOther{8, 0};
constexpr double kTile_m = 10.0;

/// One anchor for each session, at the origin of its W, and at `T_MA` in M.
MapFrames framesWith(const LevelPose& T_MA, const LevelPose& T_NA = {}) {
  mapping::SavedMap map;
  for (const AnchorId id : {1, 2}) {
    mapping::SavedAnchor& saved = map.anchors[id];
    saved.anchor.id = id;
    saved.anchor.session = id == 1 ? kSession : kOther;
    saved.T_MA = id == 1 ? T_MA : T_NA;
    saved.held_fast = true;
  }
  return MapFrames(mapping::MapState({}, map));
}

StoredPlace storedAt(ObjectId id, double x, double y, const WorldId& world = kSession) {
  return {id, world, {x, y, 0.0}, fromNanoseconds(1'000'000)};
}

LevelPose shiftedBy(double x, double y = 0.0) { return {{x, y, 0.0}, 0.0}; }

TEST(MapPlaces, SquaresAreStaleOnceForWhatCameWentOrChanged) {
  const MapFrames frames = framesWith({});
  MapPlaces places(kTile_m);
  places.put(storedAt(1, 5, 5), nullptr, frames);
  places.put(storedAt(2, 6, 5), nullptr, frames);
  places.put(storedAt(3, 25, 5), nullptr, frames);
  EXPECT_THAT(places.takeStale(), ElementsAre(Pair(Square{0, 0}, ElementsAre(1u, 2u)),
                                              Pair(Square{2, 0}, ElementsAre(3u))));
  EXPECT_THAT(places.takeStale(), IsEmpty());
  places.put(storedAt(2, 15, 5), nullptr, frames);
  places.erase(3);
  places.erase(99);
  EXPECT_THAT(places.takeStale(),
              ElementsAre(Pair(Square{0, 0}, ElementsAre(1u)), Pair(Square{1, 0}, ElementsAre(2u)),
                          Pair(Square{2, 0}, IsEmpty())));
  EXPECT_EQ(places.size(), 2u);
}

TEST(MapPlaces, WhatTheGraphMovesByLessThanADecimetreStaysUntilThatAddsUp) {
  MapPlaces places(kTile_m);
  places.put(storedAt(1, 9.98, 5), nullptr, framesWith({}));
  (void)places.takeStale();
  places.lay(framesWith(shiftedBy(0.06)));
  EXPECT_THAT(places.takeStale(), IsEmpty());
  places.lay(framesWith(shiftedBy(0.12)));
  EXPECT_THAT(places.takeStale(),
              ElementsAre(Pair(Square{0, 0}, IsEmpty()), Pair(Square{1, 0}, ElementsAre(1u))));
  places.lay(framesWith(shiftedBy(0.18)));
  EXPECT_THAT(places.takeStale(), IsEmpty());
}

TEST(MapPlaces, WhatIsNoLongerProvisionalIsShownAnewThoughItDidNotMove) {
  MapPlaces places(kTile_m);
  places.put(storedAt(1, 5, 5, kOther), nullptr, framesWith({}));
  (void)places.takeStale();
  mapping::MapState state({}, {});
  for (const AnchorId id : {1, 2}) {
    mapping::Anchor anchor;
    anchor.id = id;
    anchor.session = id == 1 ? kSession : kOther;
    state.add(anchor);
  }
  mapping::Edge loop{1, 2, {}, mapping::EdgeKind::kLoop};
  loop.T_ab.covariance = 0.01 * Eigen::Matrix4d::Identity();
  state.addLoop(loop);
  places.lay(MapFrames(state));
  EXPECT_THAT(places.takeStale(), ElementsAre(Pair(Square{0, 0}, ElementsAre(1u))));
}

TEST(MapPlaces, FindInMWhatAWalkFinds) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> any(-60.0, 60.0);
  MapPlaces places(kTile_m);
  std::map<ObjectId, Eigen::Vector3d> p_W;
  for (ObjectId id = 1; id <= 300; ++id) {
    const StoredPlace stored =
        storedAt(id, any(random), any(random), id % 10 == 0 ? kOther : kSession);
    places.put(stored, nullptr, framesWith({}));
    if (id % 10 != 0) p_W[id] = stored.p_W;
  }
  const LevelPose T_MW{{12.0, -7.0, 1.0}, 0.8};
  places.lay(framesWith(T_MW));
  for (int trial = 0; trial < 50; ++trial) {
    MapQuery query;
    query.kind = trial % 2 == 0 ? MapQueryKind::kByRadius : MapQueryKind::kByBox;
    query.low = {any(random), any(random), 0.0};
    query.radius = 1.0 + trial;
    query.high = query.low + Eigen::Vector3d::Constant(1.0 + trial);
    std::vector<std::pair<double, ObjectId>> expected;
    for (const auto& [id, p] : p_W) {
      const Eigen::Vector3d d = T_MW * p - query.low;
      if (trial % 2 == 0 ? d.norm() <= query.radius
                         : d.minCoeff() >= 0.0 && d.maxCoeff() <= 1.0 + trial) {
        expected.emplace_back(trial % 2 == 0 ? d.norm() : 0.0, id);
      }
    }
    std::sort(expected.begin(), expected.end());
    std::vector<ObjectId> ids;
    for (const auto& [distance, id] : expected) ids.push_back(id);
    EXPECT_EQ(places.find(query, kSession), ids) << trial;
  }
}

TEST(MapPlaces, WhatLiesBeyondAllSquaresIsInNone) {
  MapPlaces places(kTile_m);
  places.put(storedAt(1, 5, 5), nullptr, framesWith(shiftedBy(5e9)));
  EXPECT_THAT(places.takeStale(), IsEmpty());
  places.lay(framesWith({}));
  EXPECT_THAT(places.takeStale(), ElementsAre(Pair(Square{0, 0}, ElementsAre(1u))));
}

}  // namespace
}  // namespace perdure::map_store
