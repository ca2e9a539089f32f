// Sessions with their own frames on one map: they are located on it, join it, and ids do not
// change.
#include <gtest/gtest.h>

#include <set>

#include "common/mapping/graph/components.h"
#include "common/math/gaussian.h"
#include "tests/common/mapping/synthetic_drive.h"

namespace perdure::mapping {
namespace {

using namespace test;

constexpr double kWalk = 0.0005;

WorldId session(std::uint64_t number) { return {number, 0}; }

/// A little more than one lap, so that its own loop is closed.
Settings first(std::uint32_t seed) {
  return {.seed = seed, .yaw_walk = kWalk, .way_m = 1.1 * kLap_m, .world = session(1)};
}

/// A later session, in a W with an arbitrary origin.
Settings later(std::uint32_t seed, std::uint64_t number, double from_m, double way_m) {
  const double turn = 1.3 * from_m + static_cast<double>(number);
  return {.seed = seed,
          .yaw_walk = kWalk,
          .way_m = way_m,
          .noise = seed + 1000 * static_cast<std::uint32_t>(number),
          .world = session(number),
          .from_m = from_m,
          .T_WB = {{500.0 * std::sin(turn), -300.0 * std::cos(turn), 20.0}, wrapAngle(turn)}};
}

std::size_t joins(const Drive& drive) {
  return static_cast<std::size_t>(std::count_if(drive.loops().begin(), drive.loops().end(),
                                                [](const auto& loop) { return loop.joins; }));
}

std::size_t componentsIn(Drive& drive) {
  std::set<AnchorId> firsts;
  for (const auto& [id, of] : componentsOf(drive.mapper().graph())) firsts.insert(of);
  return firsts.size();
}

/// Error of the body's [p, yaw] in M, in deviations.
double sigmasOff(Drive& drive) {
  const RigidTransform T_MB = drive.mapper().T_MW() * drive.odometry().rigid();
  LevelError error = difference(levelOf(T_MB), drive.truth());
  Eigen::Matrix4d P = drive.mapper().frame()->covariance;
  // The body is up to an anchor's distance from the position for which the covariance holds.
  P.diagonal() += Eigen::Vector4d(0.01, 0.01, 0.01, 1e-5);
  return std::sqrt(squaredMahalanobis(error, P));
}

class Sessions : public ::testing::TestWithParam<std::uint32_t> {};

TEST_P(Sessions, FindTheMapWhereverTheyBegin) {
  Drive before(first(GetParam()));
  before.toTheEnd();
  for (const double from_m : {0.0, 95.0, 260.0, 410.0, 555.0}) {
    const auto archive = std::make_shared<Archive>(*before.archive());  // each starts from the same
                                                                        // archive
    Drive drive(later(GetParam(), 2, from_m, 130.0), before.whole(), archive);
    drive.toTheFirstLoop();
    ASSERT_EQ(joins(drive), 1u) << from_m;
    EXPECT_LT(drive.way_m(), 120.0) << from_m;
    EXPECT_LT(sigmasOff(drive), 5.0) << from_m << ", off by " << drive.off() << " m";
    EXPECT_LT(drive.off(), 1.5) << from_m;
    const auto frame = drive.mapper().frame();
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->map, session(1)) << "M stays that of the older one";
    EXPECT_EQ(frame->sessions, 2u);
    EXPECT_EQ(componentsIn(drive), 1u);
    const std::size_t merged = drive.right();
    EXPECT_GE(merged, 3u) << from_m;
    EXPECT_EQ(drive.wrong(), 0u) << from_m;
    // Objects that are detected afterwards get their old ids.
    drive.to(drive.way_m() + 150.0);
    EXPECT_EQ(joins(drive), 1u) << from_m;
    EXPECT_EQ(drive.wrong(), 0u) << from_m;
    EXPECT_GE(drive.recalled(), 8u)
        << from_m << " way " << drive.way_m() << " renamed " << drive.renamed() << " near "
        << drive.mapper().near(drive.odometry().p, 60.0).size() << " sigma "
        << drive.mapper().frame()->covariance.diagonal().transpose();
    EXPECT_LT(drive.off(), 1.5) << from_m;
  }
}

INSTANTIATE_TEST_SUITE_P(Towns, Sessions, ::testing::Values(1, 2, 3));

TEST(Session, ForeignObjectsAreNotTakenForTheMap) {
  std::size_t asked = 0;
  for (const std::uint32_t seed : {1u, 2u, 3u}) {
    Drive before(first(seed));
    before.toTheEnd();
    const auto archive = std::make_shared<Archive>(*before.archive());
    for (const auto& [id, thing] : before.things()) archive->thing_of[id] = 100'000 + thing;
    for (const std::uint32_t other : {101u, 102u}) {
      Settings foreign = later(seed, 2, 100.0, 300.0);
      foreign.seed = other + seed;
      Drive drive(foreign, before.whole(), archive);
      drive.toTheEnd();
      EXPECT_EQ(joins(drive), 0u) << seed << " " << other;
      EXPECT_EQ(componentsIn(drive), 2u);
      EXPECT_EQ(drive.mapper().frame()->map, session(2));
      EXPECT_EQ(drive.mapper().frame()->sessions, 1u);
      EXPECT_EQ(drive.wrong() + drive.right(), 0u);
      // Objects without a loop closure are not offered either.
      for (const Recallable& there : drive.mapper().near(drive.odometry().p, 1e4)) {
        EXPECT_EQ(drive.mapper().recordOf(there.id)->session, session(2)) << there.id;
      }
      ++asked;
    }
  }
  EXPECT_EQ(asked, 6u);
}

TEST(Session, AThirdOneJoinsTheOtherTwo) {
  Drive one(first(4));
  one.toTheEnd();
  const ObjectId next = one.archive()->next_id;
  Drive two(later(4, 2, 120.0, 300.0), one);
  two.toTheEnd();
  ASSERT_EQ(joins(two), 1u);
  Drive three(later(4, 3, 300.0, 200.0), two);
  three.toTheEnd();
  EXPECT_EQ(joins(three), 1u);
  EXPECT_EQ(three.wrong(), 0u);
  EXPECT_EQ(componentsIn(three), 1u);
  EXPECT_EQ(three.mapper().frame()->sessions, 3u);
  EXPECT_EQ(three.mapper().frame()->map, session(1));
  EXPECT_LT(three.off(), 1.5);
  // Ids are those of the first session, whichever session detected the object last.
  std::size_t of_the_first = 0;
  for (const TrackId track : three.inSight()) {
    const ObjectId id = three.objectOf(track);
    const ObjectRecord* record = three.mapper().recordOf(id);
    if (record == nullptr) continue;
    EXPECT_EQ(record->session, session(3)) << id;
    of_the_first += id < next ? 1u : 0u;
  }
  EXPECT_GE(of_the_first, 3u);
}

/// An object has one id on the map, unless it was not re-identified.
TEST(Session, WhatIsJoinedIsOnTheMapOnce) {
  Drive one(first(2));
  one.toTheEnd();
  const ObjectId next = one.archive()->next_id;
  Drive two(later(2, 2, 200.0, 350.0), one);
  two.toTheEnd();
  ASSERT_EQ(joins(two), 1u);
  std::map<std::size_t, std::set<ObjectId>> ids;
  for (const auto& [id, thing] : two.things()) {
    if (two.mapper().holds(id)) ids[thing].insert(id);
  }
  std::size_t twice = 0, seen_again = 0;
  for (const auto& [thing, of] : ids) {
    const bool old = *of.begin() < next;
    const bool again = two.mapper().recordOf(*of.rbegin())->session == session(2);
    seen_again += old && again ? 1u : 0u;
    twice += of.size() > 1 ? 1u : 0u;
  }
  EXPECT_GE(seen_again, 20u);
  EXPECT_LE(10 * twice, seen_again);
}

/// Two separate streets, and a drive along both of them.
class TwoParts : public ::testing::Test {
 protected:
  TwoParts() {
    Settings a = first(3);
    a.way_m = 180.0;
    one_ = std::make_unique<Drive>(a);
    one_->toTheEnd();
    two_ = std::make_unique<Drive>(later(3, 2, 330.0, 170.0), *one_);
    two_->toTheEnd();
  }
  std::unique_ptr<Drive> one_, two_;
};

TEST_F(TwoParts, StayTwoWhileNothingJoinsThem) {
  EXPECT_EQ(joins(*two_), 0u);
  EXPECT_EQ(componentsIn(*two_), 2u);
  EXPECT_EQ(two_->mapper().frame()->map, session(2));
}

TEST_F(TwoParts, AreJoinedByAThirdAndTheYoungerMoves) {
  Drive three(later(3, 3, 40.0, 450.0), *two_);
  three.toTheFirstLoop();
  ASSERT_EQ(joins(three), 1u);
  EXPECT_EQ(three.mapper().frame()->map, session(1));
  EXPECT_EQ(componentsIn(three), 2u);
  const LevelPose oldest = three.mapper().graph().pose(1);
  while (joins(three) < 2 && three.way_m() < 450.0) three.to(three.way_m() + 1.0);
  ASSERT_EQ(joins(three), 2u) << "the other street is found from the first one's M";
  EXPECT_EQ(componentsIn(three), 1u);
  EXPECT_EQ(three.mapper().frame()->sessions, 3u);
  EXPECT_EQ(three.wrong(), 0u);
  EXPECT_EQ(difference(three.mapper().graph().pose(1), oldest).norm(), 0.0);
  EXPECT_LT(three.off(), 3.0);
  // The second street has its true position.
  for (const auto& [id, anchor] : three.mapper().anchors()) {
    if (anchor.session != session(2)) continue;
    const LevelPose truth = onLap(330.0 + anchor.way_m);
    EXPECT_LT((three.mapper().graph().pose(id).p - truth.p).norm(), 4.0) << id;
  }
}

TEST_F(TwoParts, ABodyOfTheOlderOneStaysAndWhatItMeetsMoves) {
  // The first session continues with the second one on the map.
  Settings on = first(3);
  on.way_m = 420.0;
  Drive drive(on, two_->whole(), two_->archive());
  // The session restarts 180 m along the lap, in the same W.
  on.from_m = 180.0;
  on.T_WB = one_->odometry();
  on.noise = 77;
  on.way_m = 260.0;
  on.clock_s = 18.0;
  Drive goes_on(on, two_->whole(), two_->archive());
  const RigidTransform T_MW = one_->mapper().T_MW();
  goes_on.toTheFirstLoop();
  ASSERT_EQ(joins(goes_on), 1u);
  EXPECT_EQ(goes_on.mapper().frame()->map, session(1));
  EXPECT_EQ(goes_on.mapper().frame()->sessions, 2u);
  EXPECT_LT((goes_on.mapper().T_MW().p - T_MW.p).norm(), 1.0) << "the older one does not move";
  EXPECT_EQ(goes_on.wrong(), 0u);
  for (const auto& [id, anchor] : goes_on.mapper().anchors()) {
    if (anchor.session != session(2)) continue;
    const LevelPose truth = onLap(330.0 + anchor.way_m);
    EXPECT_LT((goes_on.mapper().graph().pose(id).p - truth.p).norm(), 4.0) << id;
  }
}

TEST(Session, AClockThatBeganAnewIsNotTakenForAnEarlierTime) {
  Settings early = first(1);
  early.clock_s = 1e6;
  Drive one(early);
  one.toTheEnd();
  Drive two(later(1, 2, 95.0, 250.0), one);
  two.toTheEnd();
  ASSERT_EQ(joins(two), 1u);
  EXPECT_EQ(two.wrong(), 0u);
  std::size_t seen_again = 0;
  for (const TrackId track : two.inSight()) {
    const ObjectId id = two.objectOf(track);
    const ObjectRecord* record = two.mapper().recordOf(id);
    if (record == nullptr || !record->earlier) continue;
    EXPECT_EQ(record->session, session(2)) << id;
    EXPECT_LT(toSeconds(record->last_seen), 1e3) << id;
    EXPECT_EQ(two.mapper().anchors().at(record->earlier->anchor).session, session(1)) << id;
    ++seen_again;
  }
  EXPECT_GE(seen_again, 3u);
}

TEST(Session, TheSameMessagesGiveTheSameMap) {
  std::vector<SavedMap> maps;
  for (int run = 0; run < 2; ++run) {
    Drive one(first(2));
    one.toTheEnd();
    Drive two(later(2, 2, 200.0, 200.0), one);
    two.toTheEnd();
    maps.push_back(two.whole());
  }
  expectSame(maps[0], maps[1]);
}

}  // namespace
}  // namespace perdure::mapping
