#include "common/mapping/map_frames.h"

#include <gtest/gtest.h>

#include "common/math/so3.h"

namespace perdure::mapping {
namespace {

const WorldId kFirst{7, 0}, kSecond{8, 0};
constexpr double kSpacing_m = 10.0;

TimePoint at(double seconds) { return TimePoint{} + durationFromSeconds(seconds); }

/// Anchors 1 to 4 of one session along x, a second apart, followed by anchors 5 and 6 of another
/// session.
std::map<AnchorId, Anchor> anchors() {
  std::map<AnchorId, Anchor> result;
  for (AnchorId id = 1; id <= 6; ++id) {
    const bool first = id <= 4;
    Anchor anchor;
    anchor.id = id;
    anchor.previous = id == 1 || id == 5 ? 0 : id - 1;
    anchor.session = first ? kFirst : kSecond;
    const double n = static_cast<double>(first ? id - 1 : id - 5);
    anchor.stamp.time = at(n);
    anchor.T_WA =
        RigidTransform(rotationAboutZ(0.1 * n), Eigen::Vector3d(kSpacing_m * n, 0.0, 1.0));
    anchor.from_previous.mean = {{kSpacing_m, 0.0, 0.0}, 0.1};
    anchor.from_previous.covariance = 0.01 * Eigen::Matrix4d::Identity();
    result[id] = anchor;
  }
  return result;
}

MapState stateOf(const std::map<AnchorId, Anchor>& all) {
  MapState state({}, {});
  for (const auto& [id, anchor] : all) state.add(anchor);
  return state;
}

TEST(MapFrames, LayWhatIsStoredWhereTheGraphHasItsAnchor) {
  const auto all = anchors();
  PoseGraph graph({});
  graph.addFirst(1, levelOf(all.at(1).T_WA));
  for (AnchorId id = 2; id <= 4; ++id) graph.add(id, id - 1, all.at(id).from_previous);
  const LevelPose T_MA{{18.0, 5.0, 1.2}, 0.7};
  graph.setPose(3, T_MA);
  const MapFrames frames(graph, {all.begin(), all.find(5)});
  const Eigen::Vector3d p_A(3.0, -2.0, 0.5);
  const FrameInMap frame = frames.at(3, {});
  EXPECT_LT((frame.T_MW * (all.at(3).T_WA * p_A) - T_MA * p_A).norm(), 1e-12);
  EXPECT_EQ(frame.map, kFirst);
  EXPECT_FALSE(frame.provisional);
}

TEST(MapFrames, ASessionIsProvisionalInItsOwnMUntilALoopJoinsIt) {
  MapState state = stateOf(anchors());
  const MapFrames apart(state);
  EXPECT_EQ(apart.at(6, {}).map, kSecond);
  EXPECT_TRUE(apart.at(6, {}).provisional);
  EXPECT_FALSE(apart.at(2, {}).provisional);
  EXPECT_EQ(apart.mapOf(kSecond), kSecond);
  Edge loop{2, 5, {}, EdgeKind::kLoop};
  loop.T_ab.mean = {{0.0, 3.0, 0.0}, 0.4};
  loop.T_ab.covariance = 0.01 * Eigen::Matrix4d::Identity();
  state.move({5, 6}, state.graph().pose(2) * loop.T_ab.mean * state.graph().pose(5).inverse());
  state.addLoop(loop);
  state.optimise();
  const MapFrames joined(state);
  EXPECT_EQ(joined.at(6, {}).map, kFirst);
  EXPECT_FALSE(joined.at(6, {}).provisional);
  EXPECT_EQ(joined.mapOf(kSecond), kFirst);
  const Eigen::Vector3d beside = state.graph().pose(2) * Eigen::Vector3d(0.0, 3.0, 0.0);
  EXPECT_LT((joined.at(5, {}).T_MW * anchors().at(5).T_WA.p - beside).norm(), 1e-3);
}

TEST(MapFrames, AnObjectBelongsToTheAnchorOfItsRecordWhereThatTellsOfTheSameDetection) {
  const MapFrames frames(stateOf(anchors()));
  ObjectRecord record;
  record.session = kFirst;
  record.last_seen = at(2.5);
  record.sighting.anchor = 2;
  EXPECT_EQ(frames.anchorOf(&record, kFirst, at(2.5)), 2u);
  EXPECT_EQ(frames.anchorOf(&record, kFirst, at(3.7)), 4u) << "it was detected later";
  EXPECT_EQ(frames.anchorOf(&record, kSecond, at(2.5)), 6u) << "stored in another W";
  record.sighting.anchor = 99;
  EXPECT_EQ(frames.anchorOf(&record, kFirst, at(2.5)), 3u) << "no such anchor";
}

TEST(MapFrames, WithoutARecordItBelongsToTheLastAnchorOfItsSessionUntilThen) {
  const MapFrames frames(stateOf(anchors()));
  EXPECT_EQ(frames.anchorOf(nullptr, kFirst, at(1.0)), 2u);
  EXPECT_EQ(frames.anchorOf(nullptr, kFirst, at(1.99)), 2u);
  EXPECT_EQ(frames.anchorOf(nullptr, kFirst, at(-5.0)), 1u);
  EXPECT_EQ(frames.anchorOf(nullptr, kFirst, at(500.0)), 4u);
  EXPECT_EQ(frames.anchorOf(nullptr, {7, 1}, at(1.0)), 0u) << "another epoch";
}

TEST(MapFrames, WhatHasNoAnchorStaysWhereItIs) {
  for (const MapFrames& frames : {MapFrames(), MapFrames(stateOf(anchors()))}) {
    const WorldId other{55, 3};
    const FrameInMap frame = frames.at(frames.anchorOf(nullptr, other, at(1.0)), other);
    EXPECT_TRUE(frame.T_MW.R().isIdentity(0.0));
    EXPECT_TRUE(frame.T_MW.p.isZero(0.0));
    EXPECT_EQ(frame.map, other);
    EXPECT_FALSE(frame.provisional);
    EXPECT_EQ(frames.mapOf(other), other);
  }
}

}  // namespace
}  // namespace perdure::mapping
