// The map of a drive: two laps around a block with odometry that drifts.
#include "common/mapping/mapper.h"

#include <gtest/gtest.h>

#include "tests/common/mapping/synthetic_drive.h"

namespace perdure::mapping {
namespace {

using namespace test;

TEST(Mapper, ClosesTheLoopOfASecondLap) {
  std::size_t right = 0;
  for (const std::uint32_t seed : {1u, 2u, 3u}) {
    Drive drive({.seed = seed, .yaw_walk = 0.002});
    drive.toTheEnd();
    ASSERT_FALSE(drive.loops().empty()) << seed;
    EXPECT_EQ(drive.wrong(), 0u) << seed;
    // The correction is as large as the error was.
    EXPECT_NEAR(drive.loops().front().correction_m, drive.offBefore(),
                0.3 + 0.15 * drive.offBefore())
        << seed;
    EXPECT_LT(drive.offAfter(), 0.8) << seed << ", before: " << drive.offBefore();
    EXPECT_LT(drive.off(), 3.0) << seed << ": what is seen under its old id closes no loop";
    // After the loop closure most objects got the ids of the first lap.
    EXPECT_GT(drive.recalled(), drive.renamed()) << seed;
    right += drive.right();
  }
  EXPECT_GT(right, 3u);
}

TEST(Mapper, ClosesTheLoopThoughTheOdometryIsDeclaredTooAccurate) {
  for (const std::uint32_t seed : {1u, 2u, 3u}) {
    Drive drive({.seed = seed, .yaw_walk = 0.004, .told_yaw_walk = 0.0004});
    drive.toTheEnd();
    EXPECT_FALSE(drive.loops().empty()) << seed;
    EXPECT_EQ(drive.wrong(), 0u) << seed;
  }
}

TEST(Mapper, CorrectsTheWayBehindAsWell) {
  Drive drive(kDrifting);
  drive.toTheEnd();
  ASSERT_FALSE(drive.loops().empty());
  ASSERT_GT(drive.offBefore(), 2.0) << "a drift that shows";
  double before = 0.0, after = 0.0;
  std::size_t count = 0;
  for (const auto& [id, anchor] : drive.mapper().anchors()) {
    const LevelPose truth = onLap(anchor.way_m);
    before += (anchor.T_WA.p - truth.p).squaredNorm();
    after += (drive.mapper().graph().pose(id).p - truth.p).squaredNorm();
    ++count;
  }
  EXPECT_LT(after, 0.25 * before) << std::sqrt(before / static_cast<double>(count)) << " m before, "
                                  << std::sqrt(after / static_cast<double>(count)) << " m after";
  const auto along = drive.mapper().along(kWorld);
  EXPECT_EQ(along.size(), drive.mapper().anchors().size());
  EXPECT_TRUE(drive.mapper().along({8, 1}).empty());
}

TEST(Mapper, HoldsTheFirstLapBackUntilItsPlaceIsKnown) {
  Drive drive({.seed = 4, .yaw_walk = 0.002, .told_yaw_walk = 0.004});
  drive.to(kLap_m - 40.0);  // the start of the lap is not in view yet
  const double last_of_before_m = 250.0;
  const auto early = [&] {
    std::vector<Recallable> result;
    for (const Recallable& there : drive.mapper().near(drive.odometry().p, 40.0)) {
      const double way_m = 10.0 * toSeconds(drive.stored(there.track).last_seen);
      if (way_m < last_of_before_m) result.push_back(there);
    }
    return result;
  };
  while (drive.loops().empty() && drive.way_m() < 1.3 * kLap_m) {
    EXPECT_TRUE(early().empty()) << drive.way_m();
    drive.to(drive.way_m() + 1.0);
  }
  ASSERT_FALSE(drive.loops().empty());
  const auto there = early();
  ASSERT_GE(there.size(), 1u);
  for (const Recallable& r : there) {
    ASSERT_TRUE(r.T_now) << r.id;
    const Eigen::Vector3d laid_B =
        drive.odometry().inverse() *
        (*r.T_now * Eigen::Vector3d(drive.stored(r.track).best().mean.head<3>()));
    const Eigen::Vector3d p_B = drive.truth().inverse() * drive.thing(r.track).p;
    EXPECT_LT((laid_B - p_B).head<2>().norm(), 2.0) << r.id;
    EXPECT_LT(r.covariance.diagonal().head<2>().maxCoeff(), 1.0 + 1e-9);
    EXPECT_GT(r.covariance(0, 0), 0.0);
  }
}

TEST(Mapper, WhatWasSeenOfLateLiesWhereTheOdometryHasIt) {
  Drive drive(kDrifting);
  drive.to(100.0);
  std::size_t of_late = 0;
  for (const Recallable& there : drive.mapper().near(drive.odometry().p, 30.0)) {
    EXPECT_FALSE(there.T_now) << there.id;
    ++of_late;
  }
  EXPECT_GE(of_late, 3u);
}

TEST(Mapper, AnObjectThatIsGoneIsNotRecalled) {
  Drive drive(kDrifting);
  drive.toTheFirstLoop();
  ASSERT_FALSE(drive.loops().empty());
  const auto before = drive.mapper().near(drive.odometry().p, 40.0);
  ASSERT_FALSE(before.empty());
  const ObjectId gone = before.front().id;
  EXPECT_TRUE(drive.mapper().holds(gone));
  drive.mapper().onGone(before.front().track);
  EXPECT_FALSE(drive.mapper().holds(gone));
  const auto after = drive.mapper().near(drive.odometry().p, 40.0);
  EXPECT_EQ(after.size() + 1, before.size());
  for (const Recallable& there : after) EXPECT_NE(there.id, gone);
  // The object is not matched with an object that is detected later, either.
  const std::size_t wrong = drive.wrong();
  drive.to(drive.way_m() + 60.0);
  EXPECT_EQ(drive.wrong(), wrong);
}

TEST(Mapper, NothingOfAMergeIsLeftUnderTheYoungerId) {
  Drive drive(kDrifting);
  drive.toTheEnd();
  ASSERT_GT(drive.right(), 0u);
  std::map<std::size_t, ObjectId> by_thing;
  std::size_t twice = 0;
  for (const auto& [id, thing] : drive.things()) {
    if (drive.mapper().holds(id) && !by_thing.emplace(thing, id).second) ++twice;
  }
  EXPECT_LE(twice + drive.right(), drive.renamed());
}

TEST(Mapper, WhatIsJoinedWithAYoungOneStaysOnTheMap) {
  Drive drive(kDrifting);
  drive.to(40.0);
  const ObjectId known = drive.things().begin()->first;
  ASSERT_TRUE(drive.mapper().holds(known));
  Objects objects;
  objects.world = kWorld;
  objects.objects = {drive.stored(known)};
  ObjectBelief& young = objects.objects.front();
  young.id = 1000;
  young.confirmed = false;
  young.last_seen += durationFromSeconds(60.0);
  drive.mapper().onObjects(objects);
  EXPECT_FALSE(drive.mapper().holds(1000));
  drive.mapper().onMerged(known, 1000);
  EXPECT_TRUE(drive.mapper().holds(known));
  EXPECT_FALSE(drive.mapper().holds(1000));
}

TEST(Mapper, TheSameMessagesGiveTheSameMap) {
  Drive one(kDrifting), two(kDrifting);
  one.toTheEnd();
  two.toTheEnd();
  ASSERT_EQ(one.loops().size(), two.loops().size());
  for (const auto& [id, pose] : one.mapper().graph().poses()) {
    EXPECT_EQ(pose.p, two.mapper().graph().pose(id).p) << id;
    EXPECT_EQ(pose.yaw, two.mapper().graph().pose(id).yaw) << id;
  }
}

TEST(Mapper, WithoutDriftNothingMoves) {
  for (const std::uint32_t seed : {1u, 2u, 3u}) {
    Drive drive({.seed = seed});
    drive.to(2.0 * kLap_m);
    EXPECT_EQ(drive.wrong(), 0u);
    for (const auto& [id, anchor] : drive.mapper().anchors()) {
      EXPECT_LT((drive.mapper().graph().pose(id).p - anchor.T_WA.p).norm(), 0.5)
          << seed << " " << id;
    }
    EXPECT_LT(drive.off(), 0.5) << seed;
  }
}

TEST(Mapper, AnotherWorldIsNotLaidBesideThis) {
  Drive drive(kDrifting);
  drive.to(100.0);
  Odometry lost;
  lost.world = {kWorld.world, kWorld.epoch + 1};
  lost.state = OdometryState::kTracking;
  drive.mapper().onOdometry(lost);
  EXPECT_TRUE(drive.mapper().near(Eigen::Vector3d::Zero(), 500.0).empty());
  EXPECT_EQ(drive.mapper().along(lost.world).size(), 1u);
  EXPECT_TRUE(drive.mapper().holds(drive.things().begin()->first)) << "it stays on the map";
}

TEST(Mapper, SaysNothingBeforeTheFirstPose) {
  Mapper mapper{{}};
  Objects objects;
  objects.objects.resize(1);
  objects.objects.front().classes.resize(1);
  mapper.onObjects(objects);
  EXPECT_TRUE(mapper.near(Eigen::Vector3d::Zero(), 100.0).empty());
  EXPECT_TRUE(mapper.takeChange().loops.empty());
  EXPECT_FALSE(mapper.holds(0));
  EXPECT_EQ(mapper.T_MW().p.norm(), 0.0);
  Odometry odometry;
  odometry.state = OdometryState::kInitialising;
  mapper.onOdometry(odometry);
  EXPECT_TRUE(mapper.anchors().empty());
}

}  // namespace
}  // namespace perdure::mapping
