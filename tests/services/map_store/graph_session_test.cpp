// The graph over restarts of the map store and of the body: its reports, and the data that it does
// not change.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/services/map_store/lap_drive.h"

namespace perdure::map_store {
namespace {

using namespace test;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

const WorldId kElsewhere{78, 1};

class GraphSession : public LapDrive {
 protected:
  /// Drives a lap, then ends the store's process.
  void mapOfALap() {
    start();
    driveTo(1.2 * kLap_m);
    node_->flush();
    node_.reset();
    events_.clear();
    frames_.clear();
  }
};

TEST_F(GraphSession, ALoopIsToldOnceWithTheObjectsThatShowIt) {
  start();
  driveToTheLoop();
  ASSERT_EQ(count(EventKind::kLoopClosed), 1u);
  EXPECT_EQ(count(EventKind::kRelocalised), 0u);
  const Event event = events_.front();
  EXPECT_EQ(event.instance, 5u);
  EXPECT_EQ(event.world, kHere);
  EXPECT_TRUE(event.stamp.sameFrame(stamp(sequence_)));
  EXPECT_GT(event.probability, 0.9);
  EXPECT_LE(event.probability, 1.0);
  EXPECT_THAT(event.detail, HasSubstr("objects ("));
  EXPECT_EQ(node_->reasons().of("loops_closed"), 1u);
  const std::size_t before = events_.size();
  publish();
  publish();
  EXPECT_EQ(events_.size(), before) << "nothing new, nothing told";
}

TEST_F(GraphSession, ABodyThatBeginsElsewhereIsRelocalisedOnceAndOldIdsSurvive) {
  mapOfALap();
  const ObjectId first_new = next_id_;
  start();
  beginAnew(kElsewhere, 0.45 * kLap_m, planar(400.0, -90.0, 2.0));
  while (count(EventKind::kRelocalised) == 0 && way_m_ < 1.2 * kLap_m) step();
  ASSERT_EQ(count(EventKind::kRelocalised), 1u);
  EXPECT_EQ(node_->reasons().of("relocalised"), 1u);
  const MapNear near = nears_.back();
  EXPECT_EQ(near.world, kElsewhere);
  EXPECT_TRUE(near.corrects_drift);
  std::size_t joined = 0;
  for (const Member& member : near.members) {
    EXPECT_LT(member.object, first_new);
    EXPECT_EQ(thing_of_.at(member.object), thing_of_.at(member.track));
    if (!working_.contains(member.track)) continue;
    ++joined;
    EXPECT_GE(member.track, first_new);
    EXPECT_TRUE(has(near.placed, member.object));
  }
  EXPECT_GE(joined, 3u);
  EXPECT_THAT(near.as_published, IsEmpty());
  const RigidTransform T_BM = onLap(way_m_).inverse();
  for (const ObjectBelief& belief : near.placed) {
    const Eigen::Vector3d placed_B =
        T_WB_.inverse() * Eigen::Vector3d(belief.best().mean.head<3>());
    EXPECT_LT((placed_B - T_BM * truthOf(belief.track)).norm(), 2.0) << belief.id;
    EXPECT_LE(belief.last_seen, stamp(sequence_).time) << "clocks of sessions do not compare";
  }
  node_->flush();
  ASSERT_FALSE(frames_.empty());
  EXPECT_EQ(frames_.back().world, kElsewhere);
  EXPECT_EQ(frames_.back().map, kHere);
  EXPECT_EQ(frames_.back().sessions, 2u);
}

TEST_F(GraphSession, WhatWasPlacedBeforeARestartIsStillNotWrittenOver) {
  start();
  const MapNear near = driveToTheLoop();
  const ObjectBelief* unseen = unseenOf(near);
  ASSERT_NE(unseen, nullptr);
  const ObjectId id = unseen->id;
  const auto before = encodeBelief(stored(id));
  rest(1);
  ASSERT_TRUE(working_.contains(id));
  node_->flush();
  restartStore();
  EXPECT_EQ(encodeBelief(stored(id)), before);
  rest(1);
  EXPECT_EQ(encodeBelief(stored(id)), before) << "the filter still has it as it was placed";
  working_.erase(id);
  forgetSight(id);
  rest(1);
  EXPECT_EQ(encodeBelief(stored(id)), before) << "and has let it go";
}

TEST_F(GraphSession, ARestartBringsTheWholeGraphBack) {
  start();
  driveToTheLoop();
  node_->flush();
  const auto poses = node_->mapper().graph().poses();
  const auto T_MW = node_->mapper().along(kHere);
  node_.reset();
  start();
  EXPECT_EQ(node_->reasons().of("graph_malformed"), 0u);
  ASSERT_EQ(node_->mapper().graph().poses().size(), poses.size());
  for (const auto& [id, pose] : poses) {
    EXPECT_EQ(node_->mapper().graph().pose(id).p, pose.p) << id;
    EXPECT_EQ(node_->mapper().graph().pose(id).yaw, pose.yaw) << id;
  }
  const double off = (node_->mapper().along(kHere).back().T_MW.p - T_MW.back().T_MW.p).norm();
  EXPECT_EQ(off, 0.0);
  driveTo(way_m_ + 20.0);
  EXPECT_LE(count(EventKind::kLoopClosed), 4u) << "it does not begin anew";
}

TEST_F(GraphSession, TheFrameIsToldWhereItChangesAndNotEachSecond) {
  start();
  step();
  node_->flush();
  ASSERT_EQ(frames_.size(), 1u);
  EXPECT_EQ(frames_.back().world, kHere);
  EXPECT_EQ(frames_.back().map, kHere);
  EXPECT_EQ(frames_.back().instance, 5u);
  EXPECT_EQ(frames_.back().anchors, 1u);
  EXPECT_LT(frames_.back().T_MW.p.norm(), 1e-9);
  // The body is at rest, and its objects change.
  for (int i = 0; i < 60; ++i) {
    ++sequence_;
    for (auto& [id, belief] : working_) belief.hits += 1;
    publish();
  }
  node_->flush();
  EXPECT_EQ(frames_.size(), 1u);
  // The body drives, so anchors are stored too.
  driveTo(0.5 * kLap_m);
  node_->flush();
  EXPECT_GE(frames_.size(), 5u);
  EXPECT_LE(frames_.size(), node_->mapper().anchors().size());
  const auto before = frames_.size();
  const auto revision = frames_.back().revision;
  driveToTheLoop();
  node_->flush();
  ASSERT_GT(frames_.size(), before);
  EXPECT_GT(frames_.back().revision, revision);
  EXPECT_EQ(frames_.back().loops, 1u);
  EXPECT_GT(frames_.back().T_MW.p.norm(), 0.3) << "the drift that the loop took out";
  EXPECT_GT(frames_.back().covariance(0, 0), 0.0);
}

TEST_F(GraphSession, OfAFrameThatHasEndedNothingIsToldAsIfItWereToday) {
  start();
  driveTo(60.0);
  node_->flush();
  const auto before = frames_.size();
  // Odometry is already in another frame, objects are not.
  Odometry odometry;
  odometry.stamp = stamp(sequence_ + 1);
  odometry.world = kElsewhere;
  odometry.state = OdometryState::kTracking;
  node_->onOdometry(odometry);
  node_->flush();
  EXPECT_EQ(frames_.size(), before);
  for (const MapFrame& frame : frames_) EXPECT_EQ(frame.world, kHere);
}

TEST_F(GraphSession, ItCorrectsDriftOnlyIfItReceivesTheOdometry) {
  start();
  driveTo(70.0);
  EXPECT_TRUE(nears_.back().corrects_drift);
  node_->flush();
  node_.reset();
  nears_.clear();
  start();
  rest(1);
  ASSERT_FALSE(nears_.empty());
  EXPECT_FALSE(nears_.back().corrects_drift) << "no odometry since the start";
  for (const MapNear& near : nears_) EXPECT_THAT(near.placed, IsEmpty());
  driveTo(way_m_ + 6.0);
  EXPECT_TRUE(nears_.back().corrects_drift);
  world_ = kElsewhere;  // objects are in another frame than the odometry
  rest();
  EXPECT_EQ(nears_.back().world, kElsewhere);
  EXPECT_FALSE(nears_.back().corrects_drift);
}

TEST_F(GraphSession, AnObjectThatTheFilterEndedIsNotHeldAnyMore) {
  start();
  driveTo(70.0);
  ASSERT_TRUE(node_->mapper().holds(2));
  end(2);
  rest(1);
  EXPECT_FALSE(node_->mapper().holds(2));
  rest(12);
  EXPECT_TRUE(ended_.empty()) << "it is on the disk";
}

TEST_F(GraphSession, AMergeThatComesBeforeTheFirstPoseIsUsed) {
  mapOfALap();
  start();
  ASSERT_TRUE(node_->mapper().holds(3));
  beginAnew(kElsewhere, 0.0, {});
  ended_ = {{3, 1, stamp(sequence_ + 1).time}};
  rest(1);
  EXPECT_FALSE(node_->mapper().holds(3));
  EXPECT_TRUE(node_->mapper().holds(1));
  EXPECT_EQ(node_->mapper().identity().objectOf(3), 1u);
}

TEST_F(GraphSession, IdsAreNotGivenTwiceOverRestarts) {
  mapOfALap();
  const ObjectId taken = next_id_;
  world_ = kElsewhere;
  for (int round = 0; round < 2; ++round) {
    start();
    nears_.clear();
    filter_ = 31;
    sayHello();
    ASSERT_EQ(nears_.size(), 1u);
    EXPECT_EQ(nears_.front().client, 31u);
    EXPECT_GE(nears_.front().next_id, taken);
    EXPECT_THAT(nears_.front().placed, IsEmpty());
    EXPECT_THAT(nears_.front().as_published, IsEmpty());
    node_.reset();
  }
}

TEST_F(GraphSession, AFilterThatBeginsDuringARunGoesOnWithTheIds) {
  start();
  driveTo(100.0);
  const auto before = idsOnTheMap();
  std::set<TrackId> working;
  for (const auto& [track, belief] : working_) working.insert(track);
  ASSERT_GE(working.size(), 8u);
  const ObjectId next = next_id_;
  restartFilter();
  const MapNear near = nears_.back();
  EXPECT_EQ(near.placed.size(), working.size());
  for (const auto& [track, belief] : working_) EXPECT_TRUE(working.contains(track));
  EXPECT_GE(next_id_, next);
  rest();
  EXPECT_EQ(idsOnTheMap(), before);
  driveTo(130.0);
  const auto after = idsOnTheMap();
  for (const auto& [thing, ids] : before) EXPECT_EQ(after.at(thing), ids) << thing;
  for (const auto& [thing, ids] : after) EXPECT_EQ(ids.size(), 1u) << thing;
}

}  // namespace
}  // namespace perdure::map_store
