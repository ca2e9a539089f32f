// What becomes of loops that the graph does not believe, and of what hangs on them.
#include "common/mapping/loop_book.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/common/mapping/synthetic_drive.h"

namespace perdure::mapping {
namespace {

using namespace test;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;

/// Anchors 1 to 30 along a line, 10 m apart, and loops between the first and the last one.
class LoopBookTest : public ::testing::Test {
 protected:
  LoopBookTest() {
    graph_.addFirst(1, {});
    LevelGaussian step{{{10.0, 0.0, 0.0}, 0.0}, 1e-3 * Eigen::Matrix4d::Identity()};
    for (AnchorId id = 2; id <= 30; ++id) graph_.add(id, id - 1, step);
  }
  /// A loop that says that the end lies `off_m` beside the line.
  EdgeId loop(double off_m) {
    Edge edge{1, 30, {{{290.0, off_m, 0.0}, 0.0}, 0.01 * Eigen::Matrix4d::Identity()}};
    return graph_.add(edge);
  }
  EdgeId closed(double off_m, double way_m) {
    const EdgeId id = loop(off_m);
    book_.add({id, 1, 30, {}, false, 0.0}, graph_.pose(30), way_m);
    return id;
  }
  LoopBook::Verdict judge(double way_m) {
    (void)graph_.optimise();
    return book_.judge(graph_, way_m);
  }

  PoseGraph graph_{GraphParameters{}};
  LoopParameters parameters_;
  LoopBook book_{parameters_};
};

TEST_F(LoopBookTest, TellsABelievedLoopOnceAndHowFarItMovedTheBody) {
  const EdgeId id = closed(1.0, 300.0);
  const auto verdict = judge(300.0);
  ASSERT_THAT(verdict.told, SizeIs(1));
  EXPECT_EQ(verdict.told[0].id, id);
  EXPECT_NEAR(verdict.told[0].correction_m, 1.0, 0.3);
  EXPECT_THAT(judge(301.0).told, IsEmpty());
  EXPECT_THAT(judge(300.0 + parameters_.sound_after_m + 1.0).sound, ElementsAre(id));
}

TEST_F(LoopBookTest, ALoopThatContradictsOthersWaitsAndIsGivenUp) {
  for (int k = 0; k < 3; ++k) (void)closed(0.0, 300.0);
  ASSERT_THAT(judge(300.0).told, SizeIs(3));
  const EdgeId wrong = closed(30.0, 310.0);
  EXPECT_THAT(judge(310.0).told, IsEmpty());
  EXPECT_THAT(judge(310.0 + 0.5 * parameters_.give_up_after_m).given_up, IsEmpty());
  const auto verdict = judge(311.0 + parameters_.give_up_after_m);
  EXPECT_THAT(verdict.given_up, ElementsAre(wrong));
  EXPECT_THAT(verdict.withdrawn, IsEmpty()) << "it was never told";
}

TEST_F(LoopBookTest, AToldLoopIsWithdrawnWhenItStaysContradicted) {
  const EdgeId wrong = closed(3.0, 300.0);
  ASSERT_THAT(judge(300.0).told, SizeIs(1));
  for (int k = 0; k < 4; ++k) (void)closed(0.0, 310.0);
  EXPECT_THAT(judge(310.0).withdrawn, IsEmpty()) << "not at once";
  const auto verdict = judge(311.0 + parameters_.withdraw_after_m);
  EXPECT_THAT(verdict.withdrawn, ElementsAre(wrong));
  EXPECT_THAT(verdict.given_up, IsEmpty());
}

TEST_F(LoopBookTest, WhatAnEarlierProcessToldCountsAsToldAndWhatItHadWaitingIsGivenUp) {
  const EdgeId old = loop(0.0);
  (void)graph_.optimise();
  LoopBook book(parameters_);
  EXPECT_THAT(book.judge(graph_, 0.0).told, IsEmpty());
  for (int k = 0; k < 2; ++k) (void)loop(0.0);
  (void)graph_.optimise();
  const EdgeId wrong = loop(30.0);
  (void)graph_.optimise();
  book.add({wrong, 1, 30, {}, false, 0.0}, {}, 10.0);
  (void)book.judge(graph_, 10.0);
  EXPECT_THAT(book.begin(), ElementsAre(wrong));
  EXPECT_TRUE(graph_.edges().contains(old));
}

TEST_F(LoopBookTest, SaysWhichLoopsAreToldAndHowTheyWereFound) {
  EXPECT_TRUE(book_.isTold(3)) << "an earlier process told it";
  EXPECT_EQ(book_.closureOf(3), nullptr);
  const EdgeId sound = loop(0.0);
  PlaceMatch match;
  match.pairs = {{4, 9}};
  book_.add({sound, 1, 30, match, false, 0.0}, {}, 10.0);
  EXPECT_FALSE(book_.isTold(sound));
  (void)graph_.optimise();
  (void)book_.judge(graph_, 10.0);
  EXPECT_TRUE(book_.isTold(sound));
  ASSERT_NE(book_.closureOf(sound), nullptr);
  EXPECT_EQ(book_.closureOf(sound)->match.pairs, match.pairs);
}

TEST_F(LoopBookTest, TiesHangOnTheLoopWhoseMergesTheyRestOn) {
  book_.hang(7, 3);
  book_.hang(8, 4);
  book_.hang(9, 3);
  EXPECT_THAT(book_.tiesOf(3), ElementsAre(7u, 9u));
  book_.remove(3);
  EXPECT_THAT(book_.tiesOf(3), IsEmpty());
  EXPECT_THAT(book_.tiesOf(4), ElementsAre(8u));
}

/// Four fifths of a lap, and in its map a loop that is wrong by 25 m, with a merge that was done.
class WithdrawnLoop : public ::testing::Test {
 protected:
  static constexpr EdgeId kWrong = 100'000;

  void SetUp() override {
    drive_.to(0.8 * kLap_m);
    SavedMap map = drive_.whole();
    const AnchorId a = map.anchors.begin()->first, b = map.anchors.rbegin()->first;
    Edge edge{a, b, {}, EdgeKind::kLoop};
    const LevelPose there = map.anchors.at(b).T_MA;
    edge.T_ab.mean = map.anchors.at(a).T_MA.inverse() *
                     LevelPose{there.p + Eigen::Vector3d(20, 15, 0), there.yaw};
    edge.T_ab.covariance = 0.04 * Eigen::Matrix4d::Identity();
    map.edges[kWrong] = {edge, 1.0};
    const auto first = map.records.begin(), last = std::prev(map.records.end());
    survivor_ = first->first;
    absorbed_ = last->first;
    merge_ = {kWrong, survivor_, true, first->second, last->second};
    map.merges[absorbed_] = merge_;
    first->second = last->second;  // what was seen of the second is of the first now
    first->second.sighting.in_anchor.id = survivor_;
    first->second.last_seen += std::chrono::seconds(1);
    map.records.erase(last);
    drive_.restartOn(map);
  }

  Drive drive_{{.seed = 2, .yaw_walk = 0.002}};
  ObjectId survivor_ = 0, absorbed_ = 0;
  HungMerge merge_;
};

TEST_F(WithdrawnLoop, IsContradictedByLaterOnesAndTakenOutWithItsMerges) {
  ASSERT_TRUE(drive_.mapper().graph().edges().contains(kWrong));
  drive_.to(1.3 * kLap_m);
  ASSERT_THAT(drive_.loops(), ::testing::Not(IsEmpty()));
  ASSERT_THAT(drive_.withdrawn(), SizeIs(1));
  EXPECT_EQ(drive_.withdrawn().front().id, kWrong);
  EXPECT_FALSE(drive_.mapper().graph().edges().contains(kWrong));
  EXPECT_LT(drive_.off(), 3.0);
  ASSERT_THAT(drive_.splits(), SizeIs(1));
  EXPECT_EQ(drive_.splits().front().survivor, survivor_);
  EXPECT_EQ(drive_.splits().front().absorbed, absorbed_);
  EXPECT_FALSE(drive_.mapper().merges().contains(absorbed_));
}

TEST_F(WithdrawnLoop, BothObjectsAreAsTheyWouldBeWithoutTheMerge) {
  while (drive_.withdrawn().empty() && drive_.way_m() < 1.3 * kLap_m) drive_.to(drive_.way_m() + 1);
  ASSERT_THAT(drive_.withdrawn(), SizeIs(1));
  const SavedMap map = drive_.whole();
  ASSERT_TRUE(map.records.contains(absorbed_));
  const ObjectRecord& absorbed = map.records.at(absorbed_);
  EXPECT_EQ(absorbed.sighting.in_anchor.id, absorbed_);
  EXPECT_EQ(absorbed.sighting.anchor, merge_.absorbed_before.sighting.anchor);
  EXPECT_EQ(absorbed.sighting.in_anchor.p, merge_.absorbed_before.sighting.in_anchor.p);
  EXPECT_GT(absorbed.last_seen, merge_.absorbed_before.last_seen) << "seen since, under another id";
  ASSERT_TRUE(map.records.contains(survivor_));
}

TEST(OrderedMerges, AreKeptUntilTheirLoopIsSoundAndOutliveTheProcess) {
  Drive drive({.seed = 1, .yaw_walk = 0.002, .way_m = 3.0 * kLap_m});
  drive.toTheFirstLoop();
  ASSERT_THAT(drive.mapper().merges(), ::testing::Not(IsEmpty()));
  for (const auto& [absorbed, merge] : drive.mapper().merges()) {
    EXPECT_TRUE(merge.done) << "the drive does what it is told";
    EXPECT_EQ(merge.absorbed_before.sighting.in_anchor.id, absorbed);
    EXPECT_EQ(merge.survivor_before.sighting.in_anchor.id, merge.survivor);
    EXPECT_TRUE(drive.mapper().graph().edges().contains(merge.loop));
  }
  const auto before = keysOf(drive.mapper().merges());
  drive.restart();
  EXPECT_EQ(keysOf(drive.mapper().merges()), before);
  const double closed_m = drive.way_m();
  drive.toTheEnd();
  ASSERT_GT(drive.way_m(), closed_m + LoopParameters().sound_after_m + 100.0);
  for (const ObjectId id : before) EXPECT_FALSE(drive.mapper().merges().contains(id)) << id;
}

}  // namespace
}  // namespace perdure::mapping
