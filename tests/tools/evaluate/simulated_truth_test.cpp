#include "tools/evaluate/simulated_truth.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "common/math/so3.h"
#include "tests/common/replay/tiny_datasets.h"
#include "tests/support/camera.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

/// A body at (100, 50), heading north, with one frame and without objects.
SimulatedTruth lookingNorth() {
  const CameraCalibration camera = tests::cameraAhead(640, 480, 500.0, {0.5, 0, 0});
  const RigidTransform T_WB(rotationAboutZ(std::numbers::pi / 2), Eigen::Vector3d(100, 50, 1));
  return {{},
          replay::PoseFile(replay::PoseFormat::kTum, {{fromNanoseconds(0), T_WB}}),
          CameraModel(camera),
          {fromNanoseconds(0)}};
}

/// Adds an object ten metres ahead and `left` to the left of the body, fully visible, with a box 40
/// px high.
void addObject(SimulatedTruth& truth, std::uint64_t id, const std::string& class_name,
               double left = 0.0) {
  sim::TruthObject object;
  object.id = id;
  object.class_name = object.looks_like = class_name;
  object.size = Eigen::Vector3d(4, 1.7, 1.5);
  object.present_from = TimePoint::min(), object.present_until = TimePoint::max();
  object.keys = {{fromNanoseconds(0), Eigen::Vector3d(100 - left, 60, 1), std::numbers::pi / 2}};
  truth.truth.objects.push_back(object);
  const double x = 320 - 50 * left;
  truth.truth.views[0].push_back({id, 1.0, Box{x - 40, 220, x + 40, 260}});
}

/// Returns the row of an object with this `left`, in a world that begins at the body.
EstimateRow rowAt(double left, std::uint64_t id = 1, const std::string& class_name = "car") {
  EstimateRow row;
  row.id = id;
  row.class_name = class_name;
  row.centre_W = Eigen::Vector3d(10, left, 0);
  row.length = 4, row.width = 1.7, row.height = 1.5;
  return row;
}

ObjectScore score(const SimulatedTruth& truth, const std::vector<EstimateRow>& rows,
                  const std::string& class_name = "") {
  const std::vector<replay::StampedPose> trajectory{{fromNanoseconds(0), RigidTransform()}};
  return scoreFrames(pairWithTruth(truth, rows, trajectory, class_name).frames, {});
}

TEST(SimulatedTruth, TruthAndEstimateMeetInTheCameraWhateverTheirWorlds) {
  auto truth = lookingNorth();
  addObject(truth, 5, "car", 2.0);
  const auto s = score(truth, {rowAt(2.0)});
  EXPECT_EQ(s.cells[0][0].matched, 1U) << "under 0.5 m and 30 degrees";
  EXPECT_NEAR(s.position_error_m, 0.0, 1e-9);
  auto turned = rowAt(2.0);
  turned.yaw = std::numbers::pi;
  EXPECT_EQ(score(truth, {turned}).cells[0][0].matched, 0U);
  EXPECT_EQ(score(truth, {turned}).cells[0][2].matched, 1U);
}

TEST(SimulatedTruth, OnlyWhatIsWholeTallAndStandsCounts) {
  auto truth = lookingNorth();
  for (std::uint64_t id = 1; id <= 6; ++id) addObject(truth, id, "car");
  auto& views = truth.truth.views[0];
  views[1].visible_fraction = 0.89;
  views[2].box.x1 = -1;
  views[3].box.y1 = 236;  // 24 px
  truth.truth.objects[4].moves = true;
  truth.truth.objects[5].keys.push_back(
      {fromNanoseconds(1), Eigen::Vector3d(0, 0, 0), 0.0});  // moves to another place later
  const auto run = pairWithTruth(truth, {}, {{fromNanoseconds(0), RigidTransform()}}, "");
  ASSERT_EQ(run.frames.at(0).truth.counted.size(), 1U);
  EXPECT_EQ(run.frames.at(0).truth.counted[0].track, 1);
  EXPECT_EQ(run.frames.at(0).truth.ignored.size(), 5U);
}

TEST(SimulatedTruth, AnEstimateOnWhatDoesNotCountIsNeutral) {
  auto truth = lookingNorth();
  addObject(truth, 1, "car");
  truth.truth.views[0][0].visible_fraction = 0.3;
  EXPECT_EQ(score(truth, {rowAt(0.3)}).cells[2][2].false_alarms, 0U);
  EXPECT_EQ(score(truth, {rowAt(4.0)}).cells[2][2].false_alarms, 1U);
}

TEST(SimulatedTruth, TheClassMustBeRightAndAMatchIsNoMatchWithoutIt) {
  auto truth = lookingNorth();
  addObject(truth, 1, "van");
  const auto s = score(truth, {rowAt(0.0, 1, "car")});
  EXPECT_EQ(s.cells[2][2].matched, 0U);
  EXPECT_EQ(s.cells[2][2].false_alarms, 1U);
  EXPECT_EQ(score(truth, {rowAt(0.0, 1, "van")}).cells[2][2].matched, 1U);
}

TEST(SimulatedTruth, AToyThatIsCalledACarIsAFalseAlarmAndOneCalledOtherIsNot) {
  auto truth = lookingNorth();
  addObject(truth, 1, "toy");
  EXPECT_EQ(score(truth, {}).cells[2][2].truth, 0U) << "nobody has to find it";
  EXPECT_EQ(score(truth, {rowAt(0.0, 1, "car")}).cells[2][2].false_alarms, 1U);
  EXPECT_EQ(score(truth, {rowAt(0.0, 1, "other")}).cells[2][2].false_alarms, 0U);
}

TEST(SimulatedTruth, OneClassAloneIgnoresTheOthers) {
  auto truth = lookingNorth();
  addObject(truth, 1, "car");
  addObject(truth, 2, "van", 4.0);
  const auto s =
      score(truth, {rowAt(0.0, 1, "car"), rowAt(4.0, 2, "car"), rowAt(4.0, 3, "van")}, "car");
  EXPECT_EQ(s.cells[2][2].truth, 1U);
  EXPECT_EQ(s.cells[2][2].matched, 1U);
  EXPECT_EQ(s.cells[2][2].false_alarms, 0U) << "a car claimed on a van is neutral, as on KITTI";
}

TEST(SimulatedTruth, FramesAfterTheTrajectorysEndAreNotAskedThoseBeforeItsStartAre) {
  auto truth = lookingNorth();
  truth.frames = {fromNanoseconds(0), fromNanoseconds(1), fromNanoseconds(2)};
  addObject(truth, 1, "car");
  truth.truth.views[1] = truth.truth.views[2] = truth.truth.views[0];
  const auto run = pairWithTruth(truth, {}, {{fromNanoseconds(1), RigidTransform()}}, "");
  EXPECT_EQ(run.frames.size(), 2U);
  EXPECT_EQ(run.poses, 1U);
  EXPECT_EQ(scoreFrames(run.frames, {}).cells[2][2].truth, 2U);
}

TEST(SimulatedTruth, AFolderWithoutTruthIsRefusedWithTheFix) {
  const auto root = replay::tinyEuroc("no_truth");
  EXPECT_THAT(replay::startupErrorOf([&] { readSimulatedTruth(root); }),
              HasSubstr("perdure simulate"));
  replay::writeText(root / "objects_truth.json", "{\"objects\": []}");
  EXPECT_THAT(replay::startupErrorOf([&] { readSimulatedTruth(root); }),
              HasSubstr("visibility_truth.csv"));
  replay::writeText(root / "visibility_truth.csv",
                    "frame,object_id,visible_fraction,x1,y1,x2,y2\n");
  const auto truth = readSimulatedTruth(root);
  EXPECT_EQ(truth.frames.size(), 5U);
  EXPECT_NEAR(truth.frameInterval(), 0.05, 1e-12);
  fs::remove(root / "mav0/state_groundtruth_estimate0/data.csv");
  EXPECT_THAT(replay::startupErrorOf([&] { readSimulatedTruth(root); }),
              HasSubstr("lacks mav0/state_groundtruth_estimate0/data.csv"));
}

}  // namespace
}  // namespace perdure::tools
