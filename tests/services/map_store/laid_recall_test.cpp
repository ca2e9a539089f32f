// What the map store lays beside the body where its graph has closed a loop, and what it keeps of
// that in the file.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/services/map_store/lap_drive.h"

namespace perdure::map_store {
namespace {

using namespace test;
using ::testing::IsEmpty;

class LaidRecall : public LapDrive {};

TEST_F(LaidRecall, ALoopLaysTheFirstLapBesideTheBodyAndJoinsWhatIsOne) {
  start();
  driveTo(kLap_m - 40.0);
  ASSERT_THAT(recalled_, IsEmpty());
  const Recalled laid = driveToTheLoop();
  ASSERT_TRUE(laid.laid);
  EXPECT_TRUE(laid.graph);
  EXPECT_FALSE(laid.restore);
  EXPECT_EQ(laid.client, 11u);
  EXPECT_EQ(laid.world, kHere);
  EXPECT_EQ(laid.next_id, next_id_);
  const RigidTransform T_BM = onLap(way_m_).inverse();
  ASSERT_GT((T_WB_.p - onLap(way_m_).p).norm(), 1.0) << "a drift that shows";

  ASSERT_FALSE(laid.merges.empty());
  for (const MergeOrder& merge : laid.merges) {
    EXPECT_EQ(merge.loop, laid.merges.front().loop);
    EXPECT_LT(merge.survivor, merge.absorbed);
    EXPECT_EQ(thing_of_.at(merge.survivor), thing_of_.at(merge.absorbed));
    EXPECT_TRUE(working_.contains(merge.absorbed));
    EXPECT_TRUE(has(laid, merge.survivor)) << "what is to survive comes with it";
  }
  ASSERT_GE(laid.objects.size(), 4u);
  std::set<ObjectId> ids;
  for (const ObjectBelief& belief : laid.objects) {
    EXPECT_TRUE(ids.insert(belief.id).second) << belief.id << " twice";
    EXPECT_FALSE(working_.contains(belief.id));
    const ClassBelief& best = belief.best();
    const Eigen::Vector3d laid_B = T_WB_.inverse() * Eigen::Vector3d(best.mean.head<3>());
    const Eigen::Vector3d p_B = T_BM * things_[thing_of_.at(belief.id)].p;
    EXPECT_LT((laid_B - p_B).norm(), 1.5) << belief.id;
    EXPECT_EQ(best.name, things_[thing_of_.at(belief.id)].name);
    EXPECT_TRUE(best.cross_pose.isZero());
    EXPECT_GT(best.covariance(0, 0), 0.03) << "with the error of the graph";
    EXPECT_LT(best.covariance(0, 0), 3.0);
  }
}

TEST_F(LaidRecall, MergesAreOrderedAgainUntilTheyAreDone) {
  start();
  const Recalled laid = driveToTheLoop();
  ASSERT_FALSE(laid.merges.empty());
  recalled_.clear();
  const auto second = [&] {
    sequence_ += 11;
    publish();
  };
  second();
  ASSERT_EQ(recalled_.size(), 1u);
  EXPECT_EQ(recalled_[0].merges.size(), laid.merges.size());
  const MergeOrder done = laid.merges.front();
  Event event;
  event.kind = EventKind::kMerged;
  event.object_id = done.survivor;
  event.other_id = done.absorbed;
  event.stamp = stamp(sequence_);
  node_->onEvent(event);
  working_.erase(done.absorbed);
  second();
  ASSERT_GE(recalled_.size(), 1u);
  for (const MergeOrder& merge : recalled_.back().merges) {
    EXPECT_NE(merge.absorbed, done.absorbed);
  }
}

TEST_F(LaidRecall, AMergeThatWasDoneWhileNobodyHeardItIsKnownAfterARestart) {
  start();
  const Recalled laid = driveToTheLoop();
  ASSERT_FALSE(laid.merges.empty());
  const MergeOrder order = laid.merges.front();
  node_.reset();  // killed: the order was given
  start();
  ObjectBelief merged = working_.at(order.absorbed);
  working_.erase(order.absorbed);
  merged.id = order.survivor;
  working_[order.survivor] = merged;
  ++sequence_;
  publish();
  node_->flush();
  EXPECT_FALSE(node_->mapper().holds(order.absorbed));
  EXPECT_TRUE(node_->mapper().merges().at(order.absorbed).done);
  MapQuery query;
  query.kind = MapQueryKind::kById;
  query.object_id = order.absorbed;
  EXPECT_TRUE(answerTo(query).objects.empty()) << "it is not on the map beside the survivor";
}

TEST_F(LaidRecall, WhereItLaidAnUnseenObjectIsNotWrittenOverWhatWasSeen) {
  start();
  const Recalled laid = driveToTheLoop();
  const ObjectBelief* unseen = unseenOf(laid);
  ASSERT_NE(unseen, nullptr);
  const ObjectId id = unseen->id;
  const auto before = encodeBelief(stored(id));
  takeUp(*unseen);
  ++sequence_;
  publish();
  EXPECT_EQ(encodeBelief(stored(id)), before) << "in the working set";
  working_.erase(id);
  ++sequence_;
  publish();
  EXPECT_EQ(encodeBelief(stored(id)), before) << "and after it left unseen";

  takeUp(*unseen);
  ++sequence_;
  publish();
  working_[id] = seen(id, unseen->best().mean.head<3>(), "car");
  ++sequence_;
  publish();
  EXPECT_EQ(stored(id).last_seen, stamp(sequence_ - 1).time) << "seen again, it is written";
  EXPECT_NE(encodeBelief(stored(id)), before);
}

TEST_F(LaidRecall, WhatLeftUnseenIsLaidAgainWhenItIsAskedFor) {
  start();
  const Recalled laid = driveToTheLoop();
  const ObjectBelief* unseen = unseenOf(laid);
  ASSERT_NE(unseen, nullptr);
  const ObjectBelief there = *unseen;
  takeUp(there);
  ++sequence_;
  publish();
  ask(there.best().mean.head<3>(), 20.0);
  for (const Recalled& answer : recalled_) EXPECT_FALSE(has(answer, there.id)) << "it is there";
  working_.erase(there.id);
  ++sequence_;
  publish();
  ask(there.best().mean.head<3>(), 20.0);
  ASSERT_EQ(recalled_.size(), 2u);
  EXPECT_FALSE(recalled_[0].laid);
  EXPECT_TRUE(recalled_[0].graph);
  EXPECT_FALSE(has(recalled_[0], there.id)) << "where it was, is no longer true";
  EXPECT_TRUE(recalled_[1].laid);
  EXPECT_TRUE(has(recalled_[1], there.id));
}

TEST_F(LaidRecall, WhatThisLapLeftBehindIsRecalledAsItWasStored) {
  start();
  driveTo(70.0);
  const ObjectId left = 1;
  ASSERT_FALSE(working_.contains(left));
  const ObjectBelief as_stored = stored(left);
  ask(as_stored.best().mean.head<3>(), 5.0);
  ASSERT_FALSE(recalled_.empty());
  EXPECT_FALSE(recalled_.front().laid);
  ASSERT_TRUE(has(recalled_.front(), left));
  EXPECT_EQ(recalled_.front().objects.front().best().mean, as_stored.best().mean);
}

TEST_F(LaidRecall, TheGraphOutlivesTheProcess) {
  start();
  driveTo(70.0);
  const ObjectBelief as_stored = stored(1);
  node_.reset();
  start();
  step();
  EXPECT_TRUE(node_->mapper().holds(1));
  EXPECT_GT(node_->mapper().anchors().size(), 5u);
  ask(as_stored.best().mean.head<3>(), 5.0);
  ASSERT_EQ(recalled_.size(), 1u);
  EXPECT_FALSE(recalled_.front().laid);
  EXPECT_TRUE(recalled_.front().graph);
  ASSERT_TRUE(has(recalled_.front(), 1));
  EXPECT_EQ(recalled_.front().objects.front().best().mean, as_stored.best().mean);
  EXPECT_EQ(recalled_.front().objects.front().best().covariance, as_stored.best().covariance);
}

TEST_F(LaidRecall, WithoutAGraphNothingIsLaid) {
  config_.graph = false;
  start();
  driveTo(1.3 * kLap_m);
  EXPECT_THAT(recalled_, IsEmpty());
  ask(T_WB_.p, 40.0);
  ASSERT_EQ(recalled_.size(), 1u);
  EXPECT_FALSE(recalled_.front().laid);
  EXPECT_FALSE(recalled_.front().graph);
}

TEST_F(LaidRecall, WhatIsGoneIsNotLaid) {
  start();
  driveTo(kLap_m - 40.0);
  Event gone;
  gone.kind = EventKind::kGone;
  gone.world = kHere;
  gone.stamp = stamp(sequence_);
  gone.object_id = 2;
  node_->onEvent(gone);
  const Recalled laid = driveToTheLoop();
  ASSERT_TRUE(laid.laid);
  EXPECT_FALSE(has(laid, 2));
  for (const MergeOrder& merge : laid.merges) EXPECT_NE(merge.survivor, 2u);
}

}  // namespace
}  // namespace perdure::map_store
