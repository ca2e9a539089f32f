#include "tools/evaluate/memory/visits.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>

#include "common/math/so3.h"
#include "tests/support/camera.h"

namespace perdure::tools {
namespace {

using ::testing::ElementsAre;
using ::testing::Optional;

/// A body at rest at (100, 50), heading north, with a frame every ten seconds. The run's W begins
/// at the body, and may drift.
struct Drive {
  SimulatedTruth truth{{},
                       replay::PoseFile(replay::PoseFormat::kTum, {}),
                       CameraModel(tests::cameraAhead(640, 480, 500.0, {0.5, 0, 0})),
                       {}};
  std::vector<replay::StampedPose> trajectory;
  std::vector<EstimateRow> rows;

  explicit Drive(std::size_t frames) {
    std::vector<replay::StampedPose> states;
    for (std::size_t i = 0; i < frames; ++i) {
      const TimePoint time = fromNanoseconds(static_cast<std::int64_t>(i) * 10'000'000'000);
      truth.frames.push_back(time);
      states.push_back({time, RigidTransform(rotationAboutZ(std::numbers::pi / 2),
                                             Eigen::Vector3d(100, 50, 1))});
      trajectory.push_back({time, RigidTransform()});
    }
    truth.body = replay::PoseFile(replay::PoseFormat::kTum, states);
  }

  void add(std::uint64_t object, double ahead, double left, const std::string& class_name = "car") {
    sim::TruthObject one;
    one.id = object;
    one.class_name = one.looks_like = class_name;
    one.present_from = TimePoint::min(), one.present_until = TimePoint::max();
    one.keys = {{fromNanoseconds(0), Eigen::Vector3d(100 - left, 50 + ahead, 1), 0.0}};
    truth.truth.objects.push_back(one);
  }
  void see(std::uint64_t object, std::vector<std::uint64_t> frames, double fraction = 1.0) {
    for (const auto frame : frames)
      truth.truth.views[frame].push_back({object, fraction, Box{10, 10, 50, 50}});
  }
  /// Adds a row in the run's W, by the run's pose of the body.
  void report(std::uint64_t id, std::uint64_t frame, double ahead, double left,
              const std::string& class_name = "car") {
    EstimateRow row;
    row.frame = frame;
    row.time = truth.frames[frame];
    row.id = id;
    row.class_name = class_name;
    row.centre_W = trajectory[frame].T_WB * Eigen::Vector3d(ahead, left, 0);
    rows.push_back(row);
  }

  std::vector<MemoryFrame> frames() const { return besideTheBody(truth, rows, trajectory, {}); }
  MemoryScore score() const { return scoreMemory(truth, frames(), {}); }
};

std::vector<std::optional<std::uint64_t>> idsIn(const MemoryFrame& frame) {
  std::vector<std::optional<std::uint64_t>> ids;
  for (const auto& sighting : frame.sightings) ids.push_back(sighting.id);
  return ids;
}

TEST(Memory, WhatTheFrameHasDriftedDoesNotCount) {
  Drive drive(1);
  drive.trajectory[0].T_WB = RigidTransform(rotationAboutZ(0.3), Eigen::Vector3d(40, -20, 0));
  drive.add(1, 10, 2);
  drive.see(1, {0});
  drive.report(7, 0, 10.5, 2);
  EXPECT_THAT(idsIn(drive.frames()[0]), ElementsAre(Optional(7)));
}

TEST(Memory, OnlyStandingThingsInSightAndWithinReachAreAskedFor) {
  Drive drive(1);
  for (std::uint64_t object = 1; object <= 5; ++object)
    drive.add(object, object == 2 ? 25.1 : 10, 0, object == 3 ? "toy" : "car");
  drive.truth.truth.objects[3].moves = true;
  for (std::uint64_t object = 1; object <= 4; ++object) drive.see(object, {0});
  drive.see(5, {0}, 0.49);
  const auto frames = drive.frames();
  ASSERT_EQ(frames[0].sightings.size(), 1U);
  EXPECT_EQ(frames[0].sightings[0].object, 1U);
}

TEST(Memory, AReportMatchesOneNearObjectOfItsClass) {
  Drive drive(1);
  drive.add(1, 10, 0);
  drive.add(2, 10, 1);
  drive.add(3, 20, 0);
  drive.see(1, {0}), drive.see(2, {0}), drive.see(3, {0});
  drive.report(7, 0, 10, 0.7);
  drive.report(8, 0, 20, 0, "van");
  drive.report(9, 0, 20, 1.6);
  EXPECT_THAT(idsIn(drive.frames()[0]), ElementsAre(std::nullopt, Optional(7), std::nullopt));
  EXPECT_DOUBLE_EQ(drive.score().recall(), 1.0 / 3.0);
}

TEST(Memory, AVisitGoesOnOverGapsOfLessThanAMinute) {
  Drive drive(20);
  drive.add(1, 10, 0);
  drive.see(1, {0, 1, 6, 12, 13});
  const auto visits = visitsOf(drive.frames(), {});
  ASSERT_EQ(visits.at(1).size(), 2U) << "50 s and 60 s";
  EXPECT_THAT(visits.at(1)[0].frames, ElementsAre(0, 1, 6));
  EXPECT_THAT(visits.at(1)[1].frames, ElementsAre(12, 13));
  EXPECT_EQ(visits.at(1)[0].id(), std::nullopt);
}

TEST(Memory, TheIdOfAVisitIsThatOfMostOfItsFrames) {
  Drive drive(20);
  drive.add(1, 10, 0);
  drive.see(1, {0, 1, 2, 10, 11, 12});
  drive.report(4, 0, 10, 0);
  drive.report(5, 1, 10, 0), drive.report(5, 2, 10, 0);
  drive.report(5, 10, 10, 0), drive.report(5, 11, 10, 0);
  drive.report(6, 12, 10, 0);
  const auto score = drive.score();
  EXPECT_EQ(score.seen_twice, 1U);
  EXPECT_EQ(score.reported_twice, 1U);
  EXPECT_EQ(score.kept, 1U);
  EXPECT_EQ(score.objects_matched, 1U);
  EXPECT_DOUBLE_EQ(score.idsPerObject(), 3.0);
  EXPECT_EQ(score.with_more_ids, 1U);
}

TEST(Memory, WhatIsNotReportedTwiceIsNoLossOfAnId) {
  Drive drive(20);
  for (std::uint64_t object = 1; object <= 3; ++object) {
    drive.add(object, 10, 5.0 * static_cast<double>(object));
    drive.see(object, {0, 10});
  }
  drive.report(1, 0, 10, 5), drive.report(1, 10, 10, 5);
  drive.report(2, 0, 10, 10), drive.report(9, 10, 10, 10);
  drive.report(3, 0, 10, 15);
  const auto score = drive.score();
  EXPECT_EQ(score.seen_twice, 3U);
  EXPECT_EQ(score.reported_twice, 2U);
  EXPECT_DOUBLE_EQ(score.keptShare(), 0.5);
}

TEST(Memory, DriftIsHowFarTheTruePlaceMovesInTheRunsFrame) {
  Drive drive(20);
  drive.trajectory[10].T_WB.p.x() += 3.0;
  drive.add(1, 10, 0);
  drive.see(1, {0, 10});
  EXPECT_NEAR(drive.score().drift_m, 3.0, 1e-9);
  drive.trajectory[10].T_WB = RigidTransform(rotationAboutZ(0.1), Eigen::Vector3d::Zero());
  EXPECT_NEAR(drive.score().drift_m, 20 * std::sin(0.05), 1e-9) << "a turn counts by the distance";
}

TEST(Memory, RecallOfTheSecondHalfIsTheRestOfTheFrames) {
  Drive drive(4);
  drive.add(1, 10, 0);
  drive.see(1, {0, 1, 2, 3});
  drive.report(1, 2, 10, 0);
  const auto score = drive.score();
  EXPECT_DOUBLE_EQ(score.recall(), 0.25);
  EXPECT_DOUBLE_EQ(score.lateRecall(), 0.5);
}

TEST(Memory, ARunThatStartsWithAMapIsComparedWithTheOneThatMadeIt) {
  Drive before(3);
  for (std::uint64_t object = 1; object <= 4; ++object) {
    before.add(object, 10, 5.0 * static_cast<double>(object));
    before.see(object, {0, 1, 2});
    if (object != 4) before.report(10 + object, 1, 10, 5.0 * static_cast<double>(object));
  }
  Drive now(4);
  now.truth = before.truth;
  now.truth.frames = Drive(4).truth.frames;
  now.truth.body = Drive(4).truth.body;
  now.truth.truth.views.clear();
  now.see(1, {0, 3}), now.see(2, {2}), now.see(3, {2, 3}), now.see(4, {2});
  // the object has a new id, because it is not recognised yet
  now.report(90, 0, 10, 5);
  now.report(12, 2, 10, 10);                             // the same object
  now.report(11, 2, 10, 15), now.report(11, 3, 10, 15);  // reports of another object
  const auto score = scoreReturn(before.frames(), now.frames(), {});
  EXPECT_EQ(score.ids, 3U);
  EXPECT_EQ(score.known, 3U) << "the fourth was never reported";
  EXPECT_EQ(score.seen, 3U);
  EXPECT_EQ(score.reported, 2U);
  EXPECT_EQ(score.kept, 1U);
  EXPECT_EQ(score.wrong, 1U);
  ASSERT_TRUE(score.first);
  EXPECT_DOUBLE_EQ(score.first->seconds, 20.0);
  EXPECT_DOUBLE_EQ(score.first->way_m, 0.0);
  EXPECT_EQ(score.first->objects, 4U);
}

TEST(Memory, ARunThatRecognisesNothingKeepsNothing) {
  Drive before(1), now(1);
  for (Drive* drive : {&before, &now}) {
    drive->add(1, 10, 0);
    drive->see(1, {0});
  }
  before.report(1, 0, 10, 0);
  now.report(2, 0, 10, 0);
  const auto score = scoreReturn(before.frames(), now.frames(), {});
  EXPECT_FALSE(score.first);
  EXPECT_EQ(score.known, 1U);
  EXPECT_EQ(score.seen, 0U);
  EXPECT_DOUBLE_EQ(score.keptShare(), 0.0);
}

}  // namespace
}  // namespace perdure::tools
