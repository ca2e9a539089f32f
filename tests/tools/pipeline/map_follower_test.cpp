// The pose of a run in M, for a map whose graph has moved its newest anchor.
#include "tools/pipeline/map_follower.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace perdure::tools {
namespace {

using ::testing::IsEmpty;
using ::testing::SizeIs;

const WorldId kSession{3, 0}, kUnjoined{4, 0};

TimePoint at(double seconds) { return TimePoint{} + durationFromSeconds(seconds); }

ObjectBelief carAt(ObjectId id, const Eigen::Vector3d& p_W, double seen_s) {
  ObjectBelief belief;
  belief.id = id;
  belief.last_seen = at(seen_s);
  belief.classes.resize(1);
  belief.classes[0].mean.head<3>() = p_W;
  return belief;
}

class MapFollowerTest : public ::testing::Test {
 protected:
  MapFollowerTest() {
    for (mapping::AnchorId id = 1; id <= 3; ++id) {
      mapping::SavedAnchor& saved = map_.anchors[id];
      saved.anchor.id = id;
      saved.anchor.previous = id == 2 ? 1 : 0;
      saved.anchor.session = id == 3 ? kUnjoined : kSession;
      saved.anchor.stamp.time = at(id == 2 ? 10.0 : 0.0);
      saved.anchor.T_WA.p.x() = id == 2 ? 100.0 : 0.0;
      saved.anchor.from_previous.mean.p.x() = 100.0;
      saved.anchor.from_previous.covariance = 0.01 * Eigen::Matrix4d::Identity();
      saved.T_MA.p = saved.anchor.T_WA.p;
      saved.held_fast = id != 2;
    }
    map_.anchors[2].T_MA.p.y() = kMoved_m;
    mapping::Edge loop{1, 2, {}, mapping::EdgeKind::kLoop};
    loop.T_ab.covariance = 0.01 * Eigen::Matrix4d::Identity();
    map_.edges[7] = {loop, 0.9};
    map_.edges[8] = {loop, 0.1};
    loop.b = 3;
    map_.edges[9] = {loop, 0.1};
    mapping::ObjectRecord& record = map_.records[5];
    record.session = kSession;
    record.last_seen = at(1.0);
    record.confirmed = true;
    record.sighting.anchor = 1;
    record.sighting.in_anchor.p = {20.0, 3.0, 0.0};
    record.sighting.in_anchor.yaw = 3.0;
  }

  mapping::Mapper mapper() const { return mapping::Mapper({}, map_); }
  static Odometry odometryAt(double x, double seconds, const WorldId& world = kSession) {
    Odometry odometry;
    odometry.world = world;
    odometry.state = OdometryState::kTracking;
    odometry.stamp = {1, static_cast<std::uint64_t>(seconds), at(seconds), 0};
    odometry.T_WB.p.x() = x;
    return odometry;
  }

  static constexpr double kMoved_m = 5.0;
  mapping::SavedMap map_;
};

TEST_F(MapFollowerTest, TellsWhereTheMapHadTheBodyAndHasItInTheEnd) {
  mapping::Mapper map = mapper();
  MapFollower follower(kSession);
  const Odometry odometry = odometryAt(103.0, 11.0);
  follower.follow(odometry, map);  // the map has not received this frame
  EXPECT_THAT(follower.finish(map, {}).then, IsEmpty());
  map.onOdometry(odometry);
  follower.follow(odometry, map);
  follower.follow(odometryAt(0.0, 12.0, kUnjoined), map);
  const DriveInMap drive = follower.finish(map, {});
  ASSERT_THAT(drive.then, SizeIs(1));
  EXPECT_LT((drive.then.at(11) - Eigen::Vector3d(103.0, kMoved_m, 0.0)).norm(), 1e-9);
  ASSERT_THAT(drive.along, SizeIs(2));
  const auto half = drive.T_MB({at(5.0), odometryAt(50.0, 5.0).T_WB});
  EXPECT_LT((half.p - Eigen::Vector3d(50.0, 0.5 * kMoved_m, 0.0)).norm(), 1e-9);
}

TEST_F(MapFollowerTest, AnchorsAndLoopsAreThoseOfTheSessionsOwnM) {
  mapping::Mapper map = mapper();
  const DriveInMap drive = MapFollower(kSession).finish(map, {});
  EXPECT_THAT(drive.anchors_M, SizeIs(2)) << "the third lies in an M of its own";
  ASSERT_THAT(drive.loops, SizeIs(2));
  EXPECT_TRUE(drive.loops[0].believed);
  EXPECT_FALSE(drive.loops[1].believed);
  EXPECT_NEAR((drive.loops[0].b_M - drive.loops[0].a_M).y(), kMoved_m, 1e-9);
}

TEST_F(MapFollowerTest, ObjectsLieByTheirAnchorsAndUnseenOnesWhereTheGraphHasThem) {
  mapping::Mapper map = mapper();
  ObjectBelief laid = carAt(5, {22.0, 9.0, 0.0}, 1.0);
  laid.classes[0].mean[3] = -0.1;  // 180° from the yaw in the record, and a little more
  laid.recalled = true;
  const ObjectBelief early = carAt(6, {30.0, 1.0, 0.0}, 3.0), late = carAt(7, {110, 1, 0}, 12.0);
  const DriveInMap drive = MapFollower(kSession).finish(map, {laid, early, late});
  const auto placeOf = [&](const ObjectBelief& belief) -> Eigen::Vector3d {
    return drive.objects.at(belief.id) * Eigen::Vector3d(belief.best().mean.head<3>());
  };
  EXPECT_LT((placeOf(early) - Eigen::Vector3d(30.0, 1.0, 0.0)).norm(), 1e-9);
  EXPECT_LT((placeOf(late) - Eigen::Vector3d(110.0, 1.0 + kMoved_m, 0.0)).norm(), 1e-9);
  EXPECT_LT((placeOf(laid) - Eigen::Vector3d(20.0, 3.0, 0.0)).norm(), 1e-9);
  const Eigen::Vector3d ahead = drive.objects.at(5).R().col(0);
  EXPECT_LT(std::abs(std::atan2(ahead.y(), ahead.x())), 0.1) << "not turned round";
}

TEST_F(MapFollowerTest, ARunThatTheMapDidNotFollowIsInW) {
  const mapping::Mapper empty({});
  const DriveInMap drive = MapFollower(kSession).finish(empty, {carAt(1, {1, 2, 3}, 0.0)});
  EXPECT_THAT(drive.along, IsEmpty());
  EXPECT_TRUE(drive.T_MW(at(3.0)).p.isZero(0.0));
}

}  // namespace
}  // namespace perdure::tools
