// Loop closures that the graph rejects, and the facts that depend on them.
#include "common/mapping/loop_book.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <iterator>
#include <utility>

#include "tests/common/mapping/synthetic_drive.h"

namespace perdure::mapping {
namespace {

using namespace test;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;

/// Anchors 1 to 30 along a line, 10 m apart, and loop closures between the first and the last one.
class LoopBookTest : public ::testing::Test {
 protected:
  LoopBookTest() {
    graph_.addFirst(1, {});
    LevelGaussian step{{{10.0, 0.0, 0.0}, 0.0}, 1e-3 * Eigen::Matrix4d::Identity()};
    for (AnchorId id = 2; id <= 30; ++id) graph_.add(id, id - 1, step);
  }
  /// A loop closure that places the end `off_m` beside the line.
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

/// Four fifths of a lap with a loop closure that is wrong by 25 m. By it, a track in view and one
/// from 200 m before are one object.
class WithdrawnLoop : public ::testing::Test {
 protected:
  static constexpr EdgeId kWrong = 100'000;
  static constexpr double kLongest_m = 1.3 * kLap_m;

  void SetUp() override {
    for (Drive* drive : {&drive_, &without_fact_}) {
      drive->to(0.8 * kLap_m);
      drive->restartOn(withLoop(drive->whole()));
    }
    SavedMap map = drive_.whole();
    ASSERT_GT(map.records.size(), 20u);
    known_ =
        std::next(map.records.begin(), static_cast<std::ptrdiff_t>(map.records.size() / 2))->first;
    seen_ = map.records.rbegin()->first;
    before_ = map.records.at(seen_);
    drive_.restartOn(withFact(std::move(map), {kWrong, known_, seen_}));
  }

  static SavedMap withLoop(SavedMap map) {
    const AnchorId a = map.anchors.begin()->first, b = map.anchors.rbegin()->first;
    Edge edge{a, b, {}, EdgeKind::kLoop};
    const LevelPose there = map.anchors.at(b).T_MA;
    edge.T_ab.mean = map.anchors.at(a).T_MA.inverse() *
                     LevelPose{there.p + Eigen::Vector3d(20, 15, 0), there.yaw};
    edge.T_ab.covariance = 0.04 * Eigen::Matrix4d::Identity();
    map.edges[kWrong] = {edge, 1.0};
    return map;
  }
  static SavedMap withFact(SavedMap map, const SameObject& fact) {
    MapState state({}, map);
    state.unite(fact);
    apply(state.unsaved(), map);
    return map;
  }
  static void toTheWithdrawal(Drive& drive) {
    while (drive.withdrawn().empty() && drive.way_m() < kLongest_m) drive.to(drive.way_m() + 1.0);
    ASSERT_THAT(drive.withdrawn(), SizeIs(1));
  }

  Drive drive_{{.seed = 2, .yaw_walk = 0.002}}, without_fact_{{.seed = 2, .yaw_walk = 0.002}};
  TrackId known_ = 0, seen_ = 0;
  ObjectRecord before_;  ///< record of the track in view
};

TEST_F(WithdrawnLoop, IsContradictedByLaterOnesAndTakenOutWithItsFacts) {
  ASSERT_TRUE(drive_.mapper().graph().edges().contains(kWrong));
  ASSERT_EQ(drive_.objectOf(seen_), known_);
  ASSERT_FALSE(drive_.mapper().holds(seen_));
  drive_.to(kLongest_m);
  ASSERT_THAT(drive_.loops(), ::testing::Not(IsEmpty()));
  ASSERT_THAT(drive_.withdrawn(), SizeIs(1));
  EXPECT_EQ(drive_.withdrawn().front().id, kWrong);
  EXPECT_THAT(drive_.withdrawn().front().pairs, ElementsAre(std::pair(known_, seen_)));
  EXPECT_FALSE(drive_.mapper().graph().edges().contains(kWrong));
  EXPECT_LT(drive_.off(), 3.0);
  ASSERT_THAT(drive_.splits(), SizeIs(1));
  EXPECT_EQ(drive_.splits().front().survivor, known_);
  EXPECT_EQ(drive_.splits().front().absorbed, seen_);
  EXPECT_THAT(drive_.mapper().identity().factsOf(kWrong), IsEmpty());
  EXPECT_EQ(drive_.objectOf(seen_), seen_);
}

TEST_F(WithdrawnLoop, BothObjectsAreAsTheyWouldBeWithoutTheFact) {
  toTheWithdrawal(drive_);
  toTheWithdrawal(without_fact_);
  ASSERT_EQ(drive_.way_m(), without_fact_.way_m());
  const SavedMap map = drive_.whole(), expected = without_fact_.whole();
  EXPECT_GT(expected.records.at(seen_).last_seen, before_.last_seen) << "detected while it was one";
  for (const TrackId id : {known_, seen_}) {
    ASSERT_TRUE(map.records.contains(id)) << id;
    expectSame(map.records.at(id), expected.records.at(id), "track " + std::to_string(id));
    EXPECT_FALSE(map.tracks.contains(id)) << id;
  }
}

TEST_F(WithdrawnLoop, WhatEndedUnderOneIdDoesNotEndTheOther) {
  SavedMap map = without_fact_.whole();
  const auto older =
      std::next(map.records.begin(), static_cast<std::ptrdiff_t>(map.records.size() / 3));
  const TrackId old = older->first, young = known_;
  const ObjectRecord before = older->second;
  ASSERT_LT(old, young);
  without_fact_.restartOn(withFact(std::move(map), {kWrong, old, young}));
  Drive& drive = without_fact_;
  drive.mapper().onGone(young);
  EXPECT_FALSE(drive.mapper().holds(old)) << "it was detected last as the track that ended";
  toTheWithdrawal(drive);
  EXPECT_FALSE(drive.mapper().holds(young));
  ASSERT_TRUE(drive.mapper().holds(old));
  expectSame(*drive.mapper().recordOf(old), before, "the other track");
}

}  // namespace
}  // namespace perdure::mapping
