// Tests the reading of a map file in M and in W, and of the data stored with a belief.
#include "tools/map/map_source.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "common/base/errors.h"
#include "common/math/so3.h"
#include "tests/services/map_store/beliefs.h"

namespace perdure::tools {
namespace {

using map_store::test::carAt;
using map_store::test::TemporaryFolder;
using map_store::test::workingSet;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::SizeIs;

const WorldId kWorld{77, 1};  // the world of workingSet
constexpr double kShift_m = 8.0;

/// Three anchors, 100 m apart. The graph has moved the third by 8 m and rotated it by 90°.
class MapSource : public ::testing::Test {
 protected:
  MapSource() {
    mapping::Unsaved unsaved;
    mapping::SavedMap& map = unsaved.changed;
    map.classes = {"car"};
    for (mapping::AnchorId id = 1; id <= 3; ++id) {
      const double x = 100.0 * static_cast<double>(id - 1);
      mapping::SavedAnchor& saved = map.anchors[id];
      saved.anchor.id = id;
      saved.anchor.previous = id - 1;
      saved.anchor.session = kWorld;
      saved.anchor.stamp.time = fromNanoseconds(1'000'000'000 * static_cast<std::int64_t>(id));
      saved.anchor.T_WA.p.x() = saved.anchor.way_m = x;
      saved.anchor.from_previous.mean.p.x() = id == 1 ? 0.0 : 100.0;
      saved.anchor.from_previous.covariance = Eigen::Matrix4d::Identity();
      saved.T_MA.p.x() = x;
      saved.held_fast = id == 1;
    }
    map.anchors[3].T_MA = {{200.0, kShift_m, 0.0}, 0.5 * std::numbers::pi};
    map.edges[5] = edge(1, 3, mapping::EdgeKind::kLoop, 0.9);
    map.edges[6] = edge(1, 2, mapping::EdgeKind::kTracking, 0.1);
    map.records[10] = record(10, 1);
    map.records[20] = record(20, 3);
    map.records[20].earlier = mapping::Sighting{1, map.records[20].sighting.in_anchor};
    ObjectBelief seen_again = carAt(20, {203, 0, 0});
    seen_again.why.existence[static_cast<std::size_t>(ExistenceEvidence::kRecall)].count = 2;
    const Objects both = workingSet(1, {carAt(10, {5, 1, 0}), seen_again, carAt(30, {40, 0, 0})});
    map_store::MapDatabase database({path_});
    EXPECT_TRUE(database.takeGraph().has_value());
    EXPECT_TRUE(database.write({&both, {}, {}, {}, &unsaved}).has_value());
    Objects later = both;
    later.objects.pop_back();
    const map_store::Removal merged{EventKind::kMerged, fromNanoseconds(900'000'000'000), 20};
    map_store::Batch last{&later, {}, {{30, merged}}};
    last.cameras = "0.25 0.5 ";
    EXPECT_TRUE(database.write(last).has_value());
  }

  static mapping::SavedEdge edge(mapping::AnchorId a, mapping::AnchorId b, mapping::EdgeKind kind,
                                 double weight) {
    mapping::Edge edge{a, b, {}, kind};
    edge.T_ab.covariance = Eigen::Matrix4d::Identity();
    return {edge, weight};
  }
  static mapping::ObjectRecord record(ObjectId id, mapping::AnchorId anchor) {
    mapping::ObjectRecord record;
    record.session = kWorld;
    record.last_seen = carAt(id, {}).last_seen;
    record.confirmed = true;
    record.sighting.anchor = anchor;
    record.sighting.in_anchor.id = id;
    record.sighting.in_anchor.pmf = {{0, 1.0}};
    return record;
  }
  MapObject objectOf(ObjectId id, MapFrameChoice frame) const {
    MapQuery query;
    query.kind = MapQueryKind::kById;
    query.object_id = id;
    const auto reply = MapFile(path_).ask(query, frame);
    EXPECT_THAT(reply.objects, SizeIs(1));
    return reply.objects.empty() ? MapObject{} : reply.objects.front();
  }

  TemporaryFolder folder_;
  std::string path_ = folder_.file("map.sqlite");
};

TEST_F(MapSource, TellsTheGraphAsTheRunningServiceWould) {
  MapQuery query;
  query.limit = 1000;
  const MapReply graph = MapFile(path_).graph(query);
  ASSERT_THAT(graph.anchors, SizeIs(3));
  EXPECT_EQ(graph.anchor_count, 3u);
  EXPECT_DOUBLE_EQ(graph.anchors[2].p.y(), kShift_m);
  EXPECT_EQ(graph.anchors[0].sigma, Eigen::Vector4d::Zero());
  EXPECT_GT(graph.anchors[1].sigma.maxCoeff(), 0.5) << "an odometry of a metre";
  ASSERT_THAT(graph.loops, SizeIs(2));
  EXPECT_EQ(graph.loops[0].id, 5u);
  EXPECT_EQ(graph.loops[1].kind, MapLoopKind::kTie);
  EXPECT_EQ(graph.loops[1].state, MapLoopState::kTentative) << "its weight is .1";
}

TEST_F(MapSource, AFileIsReadInMAndOnRequestAsItIsStored) {
  const MapObject in_W = objectOf(20, MapFrameChoice::kW), in_M = objectOf(20, MapFrameChoice::kM);
  EXPECT_EQ(Eigen::Vector3d(in_W.mean.head<3>()), Eigen::Vector3d(203, 0, 0));
  EXPECT_LT((in_M.mean.head<3>() - Eigen::Vector3d(200, kShift_m + 3, 0)).norm(), 1e-9)
      << "3 m ahead of its anchor";
  EXPECT_NEAR(wrapAngle(in_M.mean[3] - in_W.mean[3]), 0.5 * std::numbers::pi, 1e-9);
  EXPECT_NEAR(in_M.covariance(1, 1), in_W.covariance(0, 0), 1e-9);
  EXPECT_EQ(in_M.world, kWorld);
  EXPECT_EQ(objectOf(10, MapFrameChoice::kM).mean, objectOf(10, MapFrameChoice::kW).mean);
}

TEST_F(MapSource, PlacesOfAFileAreLookedForInTheChosenFrame) {
  MapQuery query;
  query.kind = MapQueryKind::kByRadius;
  query.low = {200, kShift_m + 3, 0};
  query.radius = 2.0;
  EXPECT_THAT(MapFile(path_).ask(query).objects, SizeIs(1));
  EXPECT_THAT(MapFile(path_).ask(query, MapFrameChoice::kW).objects, SizeIs(0));
  query.low = {203, 0, 0};
  EXPECT_THAT(MapFile(path_).ask(query, MapFrameChoice::kW).objects, SizeIs(1));
  EXPECT_THAT(MapFile(path_).ask(query).objects, SizeIs(0));
}

TEST_F(MapSource, TellsWhatTheGraphKnowsOfAnObject) {
  const Standing there = MapFile(path_).standing(20);
  ASSERT_TRUE(there.newest && there.earlier);
  EXPECT_EQ(there.newest->anchor, 3u);
  EXPECT_EQ(there.earlier->anchor, 1u);
  EXPECT_NEAR(there.moved_m, std::hypot(3.0, kShift_m + 3.0), 1e-9);
  EXPECT_EQ(there.recalls, 2u);
  EXPECT_THAT(there.absorbed, ElementsAre(30u));
  ASSERT_THAT(there.loops, SizeIs(2));
  EXPECT_EQ(there.loops[0].id, 6u) << "the newest first";
  const std::string text = toText(there);
  EXPECT_THAT(text, HasSubstr("seen last from anchor 3"));
  EXPECT_THAT(text, HasSubstr("on the visit before from anchor 1"));
  EXPECT_THAT(text, HasSubstr("recalled from the map 2 times"));
  EXPECT_THAT(text, HasSubstr("merged into it: 30"));
  EXPECT_THAT(text, HasSubstr("loop 5 of anchors 1 and 3, by positions of objects or "
                              "landmarks: believed"));
  EXPECT_THAT(text, HasSubstr("loop 6 of anchors 1 and 2, by objects seen again under their ids: "
                              "not believed"));
  EXPECT_THAT(text, Not(HasSubstr("provisional")));
  const auto json = toJson(there);
  EXPECT_EQ(json["seen_from"]["anchor"], 3);
  EXPECT_EQ(json["loops"][1]["believed"], true);
  EXPECT_EQ(json["merged"][0], 30);
}

TEST_F(MapSource, TellsNoLoopsThatEndElsewhere) {
  const Standing there = MapFile(path_).standing(10);
  EXPECT_EQ(there.newest->anchor, 1u);
  EXPECT_FALSE(there.earlier);
  EXPECT_THAT(there.loops, SizeIs(2)) << "both end at anchor 1";
  mapping::SavedMap apart;
  apart.anchors[1].anchor.id = 1;
  apart.anchors[1].anchor.session = kWorld;
  const Standing alone = standingOf(carAt(10, {5, 1, 0}), kWorld, apart, {});
  EXPECT_THAT(toText(alone), HasSubstr("no loop ends where it was seen from"));
  const Standing nowhere = standingOf(carAt(10, {5, 1, 0}), {5, 5}, apart, {});
  EXPECT_FALSE(nowhere.newest);
  EXPECT_THAT(toText(nowhere), HasSubstr("belongs to no anchor"));
}

TEST_F(MapSource, HasTheHistoryTheCamerasAndTheTime) {
  MapFile file(path_);
  const auto ended = file.ended();
  ASSERT_THAT(ended, SizeIs(1));
  EXPECT_EQ(ended[0].last.belief.id, 30u);
  EXPECT_EQ(ended[0].end.kind, EventKind::kMerged);
  EXPECT_EQ(ended[0].end.merged_into, 20u);
  EXPECT_EQ(toSeconds(ended[0].end.time), 900.0);
  EXPECT_THAT(file.cameras(), ElementsAre(mapping::Sight{0.25, 0.5}));
  EXPECT_EQ(file.time(), workingSet(1, {}).stamp.time);
}

TEST_F(MapSource, AnObjectThatTheFileDoesNotHaveIsAnError) {
  EXPECT_THROW((void)MapFile(path_).standing(30), StartupError) << "merged away";
  EXPECT_THROW((void)MapFile(folder_.file("none.sqlite")).standing(20), StartupError);
}

}  // namespace
}  // namespace perdure::tools
