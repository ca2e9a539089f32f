#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "common/base/errors.h"
#include "common/earth/geodesy.h"
#include "tests/support/camera.h"
#include "tools/outputs/object_history.h"
#include "tools/outputs/output_writer.h"
#include "tools/outputs/stage_timer.h"

namespace perdure::tools {
namespace {

using ::testing::HasSubstr;
using ::testing::SizeIs;

std::string textOf(const std::filesystem::path& path) {
  std::ifstream file(path);
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

std::filesystem::path emptyFolder(const std::string& name) {
  const auto folder = std::filesystem::path(::testing::TempDir()) / name;
  std::filesystem::remove_all(folder);
  return folder;
}

ObjectBelief carAt(ObjectId id, double x, bool confirmed = true) {
  ObjectBelief object;
  object.id = id;
  object.existence = 0.9;
  object.confirmed = confirmed;
  ClassBelief car;
  car.name = "car";
  car.probability = 0.8;
  car.mean << x, 2.0, 0.5, 0.1, std::log(4.0), std::log(1.6), std::log(1.5);
  object.classes.push_back(car);
  object.visible_fraction = 1.0;
  object.why.existence = {{-1.0, 1, {}, {}}, {3.25, 2, {}, {}}};
  return object;
}

Objects messageAt(std::uint64_t frame, std::vector<ObjectBelief> objects) {
  Objects message;
  message.stamp.sequence = frame;
  message.stamp.time = fromNanoseconds(static_cast<std::int64_t>(frame) * 100'000'000);
  message.objects = std::move(objects);
  return message;
}

Event eventOf(EventKind kind, ObjectId id, ObjectId other = 0) {
  Event event;
  event.kind = kind;
  event.object_id = id;
  event.other_id = other;
  return event;
}

TEST(ObjectHistory, InstHoldsConfirmedStaticObjectsInSightOnly) {
  ObjectHistory history;
  ObjectBelief hidden = carAt(2, 5), moving = carAt(3, 6), fresh = carAt(4, 7, false);
  hidden.visibility = Visibility::kOccluded;
  moving.moving = 0.9;
  history.add(messageAt(0, {carAt(1, 4), hidden, moving, fresh}));
  ASSERT_THAT(history.inst(), SizeIs(1));
  EXPECT_EQ(history.inst()[0].object_id, 1u);
  EXPECT_NEAR(history.inst()[0].score, 0.72, 1e-12);
  EXPECT_NEAR(history.inst()[0].size.x(), 4.0, 1e-9);
}

TEST(ObjectHistory, FinalMapsTheLastEstimateBackToTheFirstDetectionAndIntoFramesNotHidden) {
  ObjectHistory history;
  ObjectBelief hidden = carAt(1, 4.5);
  hidden.visibility = Visibility::kOccluded;
  history.add(messageAt(0, {carAt(1, 4, false)}));
  history.add(messageAt(1, {hidden}));
  history.add(messageAt(2, {carAt(1, 5)}));
  const auto rows = history.finalRows();
  ASSERT_THAT(rows, SizeIs(2));
  EXPECT_EQ(rows[0].frame, 0u);
  EXPECT_EQ(rows[1].frame, 2u);
  EXPECT_NEAR(rows[0].p_W.x(), 5.0, 1e-12);
}

TEST(ObjectHistory, FinalBeginsWhenTheObjectIsMoreThanAFaintGuess) {
  ObjectHistory history;
  ObjectBelief guess = carAt(1, 4, false);
  guess.existence = 0.05;
  history.add(messageAt(0, {guess}));
  history.add(messageAt(1, {carAt(1, 4, false)}));
  history.add(messageAt(2, {carAt(1, 5)}));
  const auto rows = history.finalRows();
  ASSERT_THAT(rows, SizeIs(2));
  EXPECT_EQ(rows[0].frame, 1u);
}

TEST(ObjectHistory, FinalGivesTheSurvivorsIdOnceForMergedObjects) {
  ObjectHistory history;
  history.add(messageAt(0, {carAt(1, 4), carAt(2, 4.2)}));
  history.add(eventOf(EventKind::kMerged, 1, 2));
  history.add(messageAt(1, {carAt(1, 4.1)}));
  const auto rows = history.finalRows();
  ASSERT_THAT(rows, SizeIs(2));
  for (const auto& row : rows) EXPECT_EQ(row.object_id, 1u);
  EXPECT_THAT(history.inst(), SizeIs(3));  // causal: earlier rows remain
  EXPECT_THAT(history.lastBeliefs(), SizeIs(1));
}

TEST(ObjectHistory, FinalHasNoRowsOfObjectsThatProvedMovingOrGone) {
  ObjectHistory history;
  ObjectBelief drives = carAt(1, 5);
  history.add(messageAt(0, {drives, carAt(2, 8)}));
  drives.moving = 0.9;
  history.add(messageAt(1, {drives, carAt(2, 8)}));
  history.add(eventOf(EventKind::kGone, 2));
  EXPECT_THAT(history.finalRows(), SizeIs(0));
  EXPECT_THAT(history.inst(), SizeIs(3));
}

TEST(ObjectHistory, FinalOfWhatDroveBeginsWhereItCameToRest) {
  ObjectHistory history;
  const auto driving = [](ObjectId id, double x) {
    ObjectBelief car = carAt(id, x);
    car.moving = 0.9;
    return car;
  };
  history.add(messageAt(0, {carAt(1, 5), driving(2, 20.5)}));
  history.add(messageAt(1, {driving(1, 12), driving(2, 20.2)}));
  history.add(messageAt(2, {carAt(1, 30), carAt(2, 20)}));
  std::map<ObjectId, std::vector<std::uint64_t>> frames;
  for (const auto& row : history.finalRows()) frames[row.object_id].push_back(row.frame);
  EXPECT_EQ(frames[1], std::vector<std::uint64_t>{2});
  EXPECT_THAT(frames[2], SizeIs(3)) << "judged moving where it stands: it stood there";
}

TEST(ObjectHistory, WhatIsFoundAgainAfterItWasGivenUpHasItsRowsOfBefore) {
  ObjectHistory history;
  history.add(messageAt(0, {carAt(1, 8)}));
  history.add(eventOf(EventKind::kGone, 1));
  history.add(messageAt(1, {carAt(5, 8.1)}));
  history.add(eventOf(EventKind::kMerged, 1, 5));
  history.add(eventOf(EventKind::kReappeared, 1));
  history.add(messageAt(2, {carAt(1, 8.2)}));
  const auto rows = history.finalRows();
  ASSERT_THAT(rows, SizeIs(3));
  for (const auto& row : rows) EXPECT_EQ(row.object_id, 1u);
  EXPECT_THAT(history.lastBeliefs(), SizeIs(1));
}

TEST(ObjectHistory, FinalDropsFramesInWhichTheLastEstimateIsOutsideTheImage) {
  ObjectHistory history;
  history.setCamera(tests::cameraAhead(640, 480, 500));
  Objects passed = messageAt(1, {carAt(1, 10)});
  passed.T_WB.p.x() = 20.0;  // the object is now behind the camera
  history.add(messageAt(0, {carAt(1, 10)}));
  history.add(passed);
  const auto rows = history.finalRows();
  ASSERT_THAT(rows, SizeIs(1));
  EXPECT_EQ(rows[0].frame, 0u);
}

TEST(ObjectHistory, FinalDropsWhatIsLargelyBehindANearerObject) {
  ObjectHistory history;
  history.setCamera(tests::cameraAhead(640, 480, 500));
  ObjectBelief behind = carAt(2, 20), beside = carAt(3, 20);
  behind.classes[0].mean[1] = 4.0;  // this object is behind the car at x = 10, y = 2
  beside.classes[0].mean[1] = -4.0;
  history.add(messageAt(0, {carAt(1, 10), behind, beside}));
  const auto rows = history.finalRows();
  ASSERT_THAT(rows, SizeIs(2));
  EXPECT_EQ(rows[0].object_id, 1u);
  EXPECT_EQ(rows[1].object_id, 3u);
  EXPECT_THAT(history.inst(), SizeIs(3)) << "what was said at the time stays said";
}

TEST(ObjectHistory, ALaterMessageAboutTheSameFrameReplacesTheEarlier) {
  ObjectHistory history;
  history.add(messageAt(0, {carAt(1, 4)}));
  history.add(messageAt(0, {carAt(1, 5)}));
  ASSERT_THAT(history.inst(), SizeIs(1));
  EXPECT_NEAR(history.inst()[0].p_W.x(), 5.0, 1e-12);
}

TEST(OutputWriter, LeavesEveryFileWellFormed) {
  const auto folder = emptyFolder("perdure_outputs");
  OutputWriter writer(folder, "0000");
  Odometry odometry;
  odometry.state = OdometryState::kTracking;
  odometry.stamp.time = fromNanoseconds(1'500'000'000);
  writer.onOdometry(odometry);
  writer.onObjects(messageAt(0, {carAt(1, 4)}));
  writer.onEvent(eventOf(EventKind::kBorn, 1));
  writer.finish();

  EXPECT_THAT(
      textOf(folder / "objects_inst.csv"),
      HasSubstr("0000,0,0,1,car,0.720000,4.0000,2.0000,0.5000,4.0000,1.6000,1.5000,0.10000,1"));
  EXPECT_THAT(textOf(folder / "trajectory.tum"), HasSubstr("1.500000000 0.000000000"));
  const std::string rows = textOf(folder / "odometry.csv");
  EXPECT_THAT(rows, HasSubstr("\n0,1500000000,0,0,0,0,0,0,0,0,1,"));
  EXPECT_EQ(std::count(rows.begin(), rows.end(), ','), 2 * 64) << "a header and a row of 65";
  const auto objects = nlohmann::json::parse(textOf(folder / "objects.json"));
  EXPECT_EQ(objects["objects"][0]["classes"]["car"]["covariance"].size(), 7u);
  EXPECT_EQ(objects["objects"][0]["memory"], "working");
  EXPECT_EQ(objects["objects"][0]["why"]["existence"]["hit"]["log_odds"], 3.25);
  EXPECT_EQ(nlohmann::json::parse(textOf(folder / "events.jsonl"))["event"], "born");
  const auto map = nlohmann::json::parse(textOf(folder / "map.geojson"));
  EXPECT_EQ(map["type"], "FeatureCollection");
  EXPECT_FALSE(map["georeferenced"]);
  EXPECT_GT(std::filesystem::file_size(folder / "map.png"), 1000u);
  EXPECT_GT(std::filesystem::file_size(folder / "evolution.png"), 1000u);
}

TEST(OutputWriter, TheMapIsGeoreferencedAtThePoseNearestToTheAnchor) {
  const auto folder = emptyFolder("perdure_outputs_geo");
  Calibration calibration;
  calibration.anchor.emplace();
  calibration.anchor->time = fromNanoseconds(107'000'000);
  for (const bool in_time : {true, false}) {
    OutputWriter writer(folder, "0000");
    if (!in_time) calibration.anchor->time += std::chrono::seconds(5);
    writer.onCalibration(calibration);
    for (int frame = 0; frame < 3; ++frame) {  // the body is at x = 4 at the time of the anchor
      Odometry odometry;
      odometry.state = OdometryState::kTracking;
      odometry.stamp.sequence = static_cast<std::uint64_t>(frame);
      odometry.stamp.time = fromNanoseconds(100'000'000 * frame);
      odometry.T_WB.p.x() = 4.0 * frame;
      writer.onOdometry(odometry);
    }
    writer.onObjects(messageAt(1, {carAt(1, 4)}));
    writer.finish();
    const auto map = nlohmann::json::parse(textOf(folder / "map.geojson"));
    EXPECT_EQ(map["georeferenced"], in_time);
    if (!in_time) continue;
    EXPECT_NEAR(map["features"][0]["geometry"]["coordinates"][0].get<double>(), 0.0, 1e-9);
  }
}

TEST(OutputWriter, WithAMapTheMapsFilesAreInMAndTheTablesStayInW) {
  const auto folder = emptyFolder("perdure_outputs_in_map");
  OutputWriter writer(folder, "0000");
  for (int frame = 0; frame < 3; ++frame) {
    Odometry odometry;
    odometry.state = OdometryState::kTracking;
    odometry.stamp.sequence = static_cast<std::uint64_t>(frame);
    odometry.stamp.time = fromNanoseconds(100'000'000 * frame);
    odometry.T_WB.p.x() = 4.0 * frame;
    writer.onOdometry(odometry);
  }
  writer.onObjects(messageAt(1, {carAt(1, 4), carAt(2, 8)}));
  const auto shift = [](double y) {
    return RigidTransform(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0, y, 0));
  };
  DriveInMap in_map;
  in_map.along = {{fromNanoseconds(0), shift(0.0)}, {fromNanoseconds(200'000'000), shift(6.0)}};
  in_map.objects[2] = shift(5.0);
  writer.setInMap(in_map);
  writer.finish();
  const auto map = nlohmann::json::parse(textOf(folder / "map.geojson"));
  EXPECT_EQ(map["features"][0]["properties"]["local_m"][1], 2.0) << "seen at the first anchor";
  EXPECT_EQ(map["features"][1]["properties"]["local_m"][1], 7.0);
  EXPECT_THAT(textOf(folder / "trajectory_map.tum"), HasSubstr("0.100000000 4.000000000 3.0000"));
  EXPECT_THAT(textOf(folder / "trajectory.tum"), HasSubstr("0.100000000 4.000000000 0.0000"));
  EXPECT_THAT(textOf(folder / "objects_inst.csv"), HasSubstr(",8.0000,2.0000,"));
}

TEST(OutputWriter, SaysTheFixWhereTheFolderCannotBeMade) {
  try {
    const OutputWriter writer("/proc/nowhere/out", "0000");
    FAIL() << "a folder in /proc was made";
  } catch (const StartupError& error) {
    EXPECT_THAT(error.what(), HasSubstr("--out"));
    EXPECT_EQ(error.code(), ExitCode::kUnavailable);
  }
}

TEST(StageTimer, QuantilesInterpolateBetweenSamples) {
  EXPECT_DOUBLE_EQ(quantile({4, 1, 3, 2}, 0.5), 2.5);
  EXPECT_DOUBLE_EQ(quantile({1, 2, 3}, 1.0), 3.0);
  EXPECT_DOUBLE_EQ(quantile({}, 0.5), 0.0);
}

TEST(StageTimer, AStageWithinAnotherIsNotTimedTwice) {
  StageTimer timer;
  const auto work = [] {
    double sum = 0.0;
    for (int i = 1; i < 20'000'000; ++i) sum += 1.0 / i;
    EXPECT_GT(sum, 1.0);
  };
  timer.time("outer", [&] { timer.time("inner", work); });
  const auto stages = timer.toJson()["stages"];
  EXPECT_LT(stages["outer"]["cpu_ms"]["total"],
            0.1 * stages["inner"]["cpu_ms"]["total"].get<double>());
}

TEST(StageTimer, CountsCallsByStageAndHandsTheResultThrough) {
  StageTimer timer;
  EXPECT_EQ(timer.time("vio", [] { return 7; }), 7);
  timer.time("vio", [] {});
  EXPECT_EQ(timer.toJson()["stages"]["vio"]["calls"], 2);
}

}  // namespace
}  // namespace perdure::tools
