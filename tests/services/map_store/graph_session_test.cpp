// The graph over restarts of the map store and of the body: what is told of it, and what it does
// not touch.
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
  std::size_t count(EventKind kind) const {
    return static_cast<std::size_t>(std::count_if(events_.begin(), events_.end(),
                                                  [&](const Event& e) { return e.kind == kind; }));
  }
  /// A lap, and the store's process ends.
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
  ASSERT_FALSE(recalled_.empty());
  const Recalled laid = recalled_.back();
  EXPECT_TRUE(laid.laid);
  EXPECT_EQ(laid.world, kElsewhere);
  ASSERT_GE(laid.merges.size(), 3u);
  for (const MergeOrder& merge : laid.merges) {
    EXPECT_LT(merge.survivor, first_new);
    EXPECT_GE(merge.absorbed, first_new);
    EXPECT_EQ(thing_of_.at(merge.survivor), thing_of_.at(merge.absorbed));
    EXPECT_TRUE(has(laid, merge.survivor));
  }
  const RigidTransform T_BM = onLap(way_m_).inverse();
  for (const ObjectBelief& belief : laid.objects) {
    const Eigen::Vector3d laid_B = T_WB_.inverse() * Eigen::Vector3d(belief.best().mean.head<3>());
    EXPECT_LT((laid_B - T_BM * things_[thing_of_.at(belief.id)].p).norm(), 2.0) << belief.id;
    EXPECT_LE(belief.last_seen, stamp(sequence_).time) << "clocks of sessions do not compare";
  }
  node_->flush();
  ASSERT_FALSE(frames_.empty());
  EXPECT_EQ(frames_.back().world, kElsewhere);
  EXPECT_EQ(frames_.back().map, kHere);
  EXPECT_EQ(frames_.back().sessions, 2u);
}

TEST_F(GraphSession, WhatWasLaidBeforeARestartIsStillNotWrittenOver) {
  start();
  const Recalled laid = driveToTheLoop();
  const ObjectBelief* unseen = unseenOf(laid);
  ASSERT_NE(unseen, nullptr);
  const ObjectId id = unseen->id;
  const auto before = encodeBelief(stored(id));
  takeUp(*unseen);
  ++sequence_;
  publish();
  node_->flush();
  node_.reset();
  start();
  EXPECT_EQ(encodeBelief(stored(id)), before);
  ++sequence_;
  publish();
  EXPECT_EQ(encodeBelief(stored(id)), before) << "the filter still has it as it was laid";
  working_.erase(id);
  ++sequence_;
  publish();
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
  const std::size_t merged = recalled_.size();
  const double off = (node_->mapper().along(kHere).back().T_MW.p - T_MW.back().T_MW.p).norm();
  EXPECT_EQ(off, 0.0);
  driveTo(way_m_ + 20.0);
  EXPECT_LE(count(EventKind::kLoopClosed), 4u) << "it does not begin anew";
  EXPECT_GE(recalled_.size(), merged);
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
  // At rest, with objects that change.
  for (int i = 0; i < 60; ++i) {
    ++sequence_;
    for (auto& [id, belief] : working_) belief.hits += 1;
    publish();
  }
  node_->flush();
  EXPECT_EQ(frames_.size(), 1u);
  // On its way: with the anchors.
  driveTo(0.5 * kLap_m);
  node_->flush();
  EXPECT_GE(frames_.size(), 5u);
  EXPECT_LE(frames_.size(), node_->mapper().anchors().size());
  const auto before = frames_.size();
  const auto revision = frames_.back().revision;
  recalled_.clear();
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
  // Odometry is of another frame already, objects are not.
  Odometry odometry;
  odometry.stamp = stamp(sequence_ + 1);
  odometry.world = kElsewhere;
  odometry.state = OdometryState::kTracking;
  node_->onOdometry(odometry);
  node_->flush();
  EXPECT_EQ(frames_.size(), before);
  for (const MapFrame& frame : frames_) EXPECT_EQ(frame.world, kHere);
}

TEST_F(GraphSession, AnswersSayTheGraphOnlyWhereItHearsTheOdometry) {
  start();
  driveTo(70.0);
  ask(T_WB_.p, 30.0);
  ASSERT_FALSE(recalled_.empty());
  EXPECT_TRUE(recalled_.front().graph);
  node_->flush();
  node_.reset();
  start();
  publish();
  ask(T_WB_.p, 30.0);
  ASSERT_FALSE(recalled_.empty());
  EXPECT_FALSE(recalled_.front().graph) << "no odometry since the start: the filter watches drift";
  for (const Recalled& r : recalled_) EXPECT_FALSE(r.laid);
  step();
  ask(T_WB_.p, 30.0);
  EXPECT_TRUE(recalled_.front().graph);
  ++sequence_;
  world_ = kElsewhere;  // objects are of another frame than the odometry
  publish();
  ask(T_WB_.p, 30.0);
  EXPECT_FALSE(recalled_.front().graph);
}

TEST_F(GraphSession, ItsOwnEventsAreNotHeard) {
  start();
  driveTo(70.0);
  Event gone;
  gone.kind = EventKind::kGone;
  gone.world = kHere;
  gone.stamp = stamp(sequence_);
  gone.object_id = 2;
  gone.instance = 5;
  node_->onEvent(gone);
  EXPECT_TRUE(node_->mapper().holds(2));
  gone.instance = 11;
  node_->onEvent(gone);
  EXPECT_FALSE(node_->mapper().holds(2));
}

TEST_F(GraphSession, AMergeThatComesBeforeTheFirstPoseIsTaken) {
  mapOfALap();
  start();
  ASSERT_TRUE(node_->mapper().holds(3));
  Event merged;
  merged.kind = EventKind::kMerged;
  merged.instance = 11;
  merged.world = kElsewhere;
  merged.object_id = 1;
  merged.other_id = 3;
  node_->onEvent(merged);
  EXPECT_FALSE(node_->mapper().holds(3));
}

TEST_F(GraphSession, IdsAreNotGivenTwiceOverRestarts) {
  mapOfALap();
  const ObjectId taken = next_id_;
  for (int round = 0; round < 2; ++round) {
    start();
    recalled_.clear();
    MapQuery query;
    query.client = 31;
    query.kind = MapQueryKind::kRestore;
    query.world = kElsewhere;
    query.limit = 1;
    node_->onQuery(query);
    ASSERT_EQ(recalled_.size(), 1u);
    EXPECT_GE(recalled_.front().next_id, taken);
    EXPECT_THAT(recalled_.front().objects, IsEmpty());
    node_.reset();
  }
}

}  // namespace
}  // namespace perdure::map_store
