#include "tools/evaluate/memory/loops.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "common/math/so3.h"

namespace perdure::tools {
namespace {

using mapping::AnchorId;
using mapping::EdgeKind;
using mapping::LevelPose;
using ::testing::DoubleNear;
using ::testing::Optional;

constexpr int kSeconds = 80;
constexpr double kSpeed = 10.0;

TimePoint at(double seconds) {
  return fromNanoseconds(static_cast<std::int64_t>(std::llround(seconds * 1e9)));
}

/// Twice around a circle of 400 m at ten metres per second, with a roll of .2 rad.
RigidTransform bodyAt(double seconds) {
  const double radius = 400.0 / (2.0 * std::numbers::pi), angle = kSpeed * seconds / radius;
  const Eigen::Matrix3d R =
      rotationAboutZ(angle + std::numbers::pi / 2) * expSo3(Eigen::Vector3d(0.2, 0, 0));
  return {R, Eigen::Vector3d(radius * std::cos(angle), radius * std::sin(angle), 1.5)};
}

replay::PoseFile drivenWay() {
  std::vector<replay::StampedPose> poses;
  for (int i = 0; i <= 10 * kSeconds; ++i) poses.push_back({at(0.1 * i), bodyAt(0.1 * i)});
  return {replay::PoseFormat::kTum, poses};
}

LevelPose levelAt(double seconds) {
  return mapping::levelOf(mapping::levelled(bodyAt(seconds), Eigen::Vector3d::UnitZ()));
}

/// Returns a map with one anchor per second. The odometry's distances are too long by `scale`. T_MA
/// is the truth, in a rotated and shifted M.
mapping::SavedMap mapOf(double scale) {
  const LevelPose T_MW{{30, -7, 2}, 0.8};
  mapping::SavedMap map;
  for (int i = 0; i <= kSeconds; ++i) {
    mapping::SavedAnchor saved;
    saved.anchor.id = static_cast<AnchorId>(i + 1);
    saved.anchor.previous = static_cast<AnchorId>(i);
    saved.anchor.stamp.time = at(i);
    if (i > 0) {
      saved.anchor.from_previous.mean = levelAt(i - 1).inverse() * levelAt(i);
      saved.anchor.from_previous.mean.p *= 1.0 + scale;
    }
    saved.T_MA = T_MW * levelAt(i);
    map.anchors[saved.anchor.id] = saved;
  }
  return map;
}

/// Returns a loop between the anchors at two times; `off` is its error.
mapping::SavedEdge loop(int a, int b, const mapping::LevelError& off, double sigma_m = 0.1) {
  mapping::SavedEdge saved;
  saved.edge.a = static_cast<AnchorId>(a + 1);
  saved.edge.b = static_cast<AnchorId>(b + 1);
  saved.edge.T_ab.mean = levelAt(a).inverse() * levelAt(b);
  saved.edge.T_ab.mean.p += off.head<3>();
  saved.edge.T_ab.mean.yaw += off[3];
  saved.edge.T_ab.covariance =
      mapping::LevelError(sigma_m * sigma_m, 0.01, 0.01, 1e-4).asDiagonal();
  return saved;
}

LoopJudgement judged(const mapping::SavedEdge& edge) {
  mapping::SavedMap map = mapOf(0.0);
  map.edges[1] = edge;
  return judgeLoops(map, drivenWay(), {});
}

TEST(Loops, ATrueLoopOfALeaningBodyIsNotWrong) {
  const auto result = judged(loop(3, 43, {0, 0, 0, 0}));
  ASSERT_EQ(result.loops.size(), 1U);
  EXPECT_LT(result.loops[0].off_m, 1e-6);
  EXPECT_LT(result.loops[0].off_rad, 1e-6);
  EXPECT_EQ(result.loops[0].from, at(3));
  EXPECT_EQ(result.loops[0].to, at(43));
  EXPECT_EQ(result.wrong(), 0U);
  EXPECT_EQ(result.believed(), 1U);
}

TEST(Loops, WrongIsBeyondTwoMetresAndFourDeviationsAlongTheError) {
  EXPECT_EQ(judged(loop(3, 43, {1.9, 0, 0, 0})).wrong(), 0U);
  EXPECT_EQ(judged(loop(3, 43, {2.1, 0, 0, 0})).wrong(), 1U);
  EXPECT_EQ(judged(loop(3, 43, {2.1, 0, 0, 0}, 0.6)).wrong(), 0U);
  EXPECT_EQ(judged(loop(3, 43, {2.5, 0, 0, 0}, 0.6)).wrong(), 1U);
  EXPECT_EQ(judged(loop(3, 43, {0, 2.1, 0, 0}, 0.6)).wrong(), 1U) << "sure across the way";
  EXPECT_EQ(judged(loop(3, 43, {0, 0, 9, 0})).wrong(), 0U) << "height";
}

TEST(Loops, WrongIsBeyondTenDegrees) {
  EXPECT_EQ(judged(loop(3, 43, {0, 0, 0, 0.16})).wrong(), 0U);
  EXPECT_EQ(judged(loop(3, 43, {0, 0, 0, -0.19})).wrong(), 1U);
  EXPECT_EQ(judged(loop(3, 43, {0, 0, 0, std::numbers::pi})).wrong(), 1U);
  EXPECT_EQ(judged(loop(3, 43, {0, 0, 0, 2 * std::numbers::pi})).wrong(), 0U);
}

TEST(Loops, WhatTheGraphDoesNotBelieveCountsApart) {
  auto edge = loop(3, 43, {46, 0, 0, 0});
  edge.weight = 0.99 * mapping::kBelieved;
  EXPECT_EQ(judged(edge).wrong(), 1U);
  EXPECT_EQ(judged(edge).wrongBelieved(), 0U);
  edge.weight = mapping::kBelieved;
  EXPECT_EQ(judged(edge).wrongBelieved(), 1U);
}

TEST(Loops, OdometryIsNoLoopAndWhatHasNoTruthIsCounted) {
  auto edge = loop(3, 43, {46, 0, 0, 0});
  edge.edge.kind = EdgeKind::kTracking;
  EXPECT_EQ(judged(edge).wrong(), 1U);
  edge.edge.kind = EdgeKind::kOdometry;
  EXPECT_TRUE(judged(edge).loops.empty());
  EXPECT_EQ(judged(edge).unjudged, 0U);
  edge = loop(3, 43, {0, 0, 0, 0});
  edge.edge.b = 999;
  EXPECT_TRUE(judged(edge).loops.empty());
  EXPECT_EQ(judged(edge).unjudged, 1U);
  mapping::SavedMap map = mapOf(0.0);
  map.edges[1] = loop(3, 43, {0, 0, 0, 0});
  map.anchors.at(44).anchor.stamp.time = at(kSeconds + 100);
  EXPECT_EQ(judgeLoops(map, drivenWay(), {}).unjudged, 1U);
}

TEST(Loops, TheAnchorsErrorIsThatBeforeAndThatAfterLoops) {
  const auto errors = scoreAnchors(mapOf(0.05), drivenWay());
  EXPECT_EQ(errors.anchors, static_cast<std::uint64_t>(kSeconds + 1));
  EXPECT_LT(errors.map_m, 1e-6);
  // The odometry gives a circle that is larger by a twentieth, about its own centre.
  EXPECT_NEAR(errors.odometry_m, 0.05 * 400.0 / (2.0 * std::numbers::pi), 0.02);
}

TEST(Loops, PartsThatNothingJoinsAreAlignedApart) {
  mapping::SavedMap map = mapOf(0.0);
  map.anchors.at(41).anchor.previous = 0;  // another session at another place in M
  for (AnchorId id = 41; id <= 81; ++id) {
    auto& T_MA = map.anchors.at(id).T_MA;
    T_MA = LevelPose{{500, 80, 0}, 1.0} * T_MA;
  }
  EXPECT_LT(scoreAnchors(map, drivenWay()).odometry_m, 1e-6);
  EXPECT_LT(scoreAnchors(map, drivenWay()).map_m, 1e-6);
  map.edges[1] = loop(3, 43, {0, 0, 0, 0});
  EXPECT_GT(scoreAnchors(map, drivenWay()).map_m, 100.0) << "joined, and not laid together";
  map.edges[1].weight = 0.1;
  EXPECT_LT(scoreAnchors(map, drivenWay()).map_m, 1e-6);
}

/// Frames of the drive, one per second; each object is visible in some of them.
struct Seen {
  std::vector<MemoryFrame> frames;
  MemoryOptions memory;

  Seen() {
    memory.apart_s = 20.0;
    for (int i = 0; i <= kSeconds; ++i) {
      MemoryFrame frame;
      frame.time = at(i);
      frame.way_m = kSpeed * i;
      frames.push_back(frame);
    }
  }
  void see(std::uint64_t object, std::size_t first, std::size_t last) {
    for (std::size_t i = first; i <= last; ++i) frames[i].sightings.push_back({object, {}});
  }
  std::vector<ReturnVisit> returns(const std::vector<JudgedLoop>& loops) const {
    return returnVisits(frames, loops, memory, {});
  }
};

JudgedLoop closedAt(int second) {
  JudgedLoop loop;
  loop.to = at(second);
  loop.believed = true;
  return loop;
}

TEST(Loops, AReturnIsAWayAmongObjectsOfAnEarlierVisit) {
  Seen seen;
  for (std::uint64_t object = 1; object <= 4; ++object) {
    seen.see(object, 0, 3);
    seen.see(object, 40 + object, 42 + object);
  }
  seen.see(5, 0, 3), seen.see(5, 60, 61);  // a single object is not a return
  const auto returns = seen.returns({});
  ASSERT_EQ(returns.size(), 1U);
  EXPECT_EQ(returns[0].first, 41U);
  EXPECT_EQ(returns[0].last, 46U);
  EXPECT_EQ(returns[0].objects, 4U);
  EXPECT_EQ(returns[0].closed_after_m, std::nullopt);
}

TEST(Loops, AWayWithoutKnownObjectsOfThirtyMetresEndsAReturn) {
  Seen seen;
  for (std::uint64_t object = 1; object <= 8; ++object) {
    seen.see(object, 0, 3);
    seen.see(object, object <= 4 ? 40 : 42, object <= 4 ? 40 : 42);
  }
  EXPECT_EQ(seen.returns({}).size(), 1U);
  for (auto& frame : seen.frames) frame.way_m *= 1.5;
  EXPECT_EQ(seen.returns({}).size(), 2U);
}

TEST(Loops, TheWayToCloseGoesToTheFirstTrueLoopThatIsBelieved) {
  Seen seen;
  for (std::uint64_t object = 1; object <= 4; ++object) {
    seen.see(object, 0, 3);
    seen.see(object, 41, 47);
  }
  auto wrong = closedAt(42), doubted = closedAt(43);
  wrong.wrong = true;
  doubted.believed = false;
  std::vector<JudgedLoop> loops{closedAt(46), closedAt(45), wrong, doubted, closedAt(20)};
  EXPECT_THAT(seen.returns(loops)[0].closed_after_m, Optional(DoubleNear(40.0, 1e-9)));
  loops.push_back(closedAt(40));  // the loop's anchor was set before the first object was visible
  EXPECT_THAT(seen.returns(loops)[0].closed_after_m, Optional(DoubleNear(0.0, 1e-9)));
  EXPECT_EQ(seen.returns({closedAt(39)})[0].closed_after_m, std::nullopt);
}

TEST(Loops, TheScoreHasTheMedianWayAndTheReturnsWithoutALoop) {
  LoopScore score;
  EXPECT_EQ(score.wayToClose(), std::nullopt);
  score.returns = {{0, 1, 4, 30.0}, {2, 3, 4, std::nullopt}, {4, 5, 4, 10.0}};
  EXPECT_EQ(score.missed(), 1U);
  EXPECT_THAT(score.wayToClose(), Optional(20.0));
}

}  // namespace
}  // namespace perdure::tools
