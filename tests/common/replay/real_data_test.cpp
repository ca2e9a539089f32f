// Tests the readers on the real datasets, if they are present.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <fstream>

#include "common/camera/camera_model.h"
#include "common/replay/dataset.h"
#include "common/replay/files/kitti_calibration.h"
#include "common/replay/files/kitti_labels.h"

namespace perdure::replay {
namespace {

namespace fs = std::filesystem;

class RealData : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!fs::is_directory(root())) GTEST_SKIP() << root() << " is absent: real data are not tested";
  }
  static fs::path root() { return fs::path(std::getenv("PERDURE_SOURCE")) / "../shared/data"; }
};

TEST_F(RealData, TheDriveHas154PairsAndSamplesSevenMillisecondsLater) {
  const auto dataset = Dataset::open(
      {.path = root() / "kitti_raw/2011_09_26/2011_09_26_drive_0005_sync", .decode = false});
  EXPECT_EQ(dataset->frameCount(), 154U);
  std::size_t left = 0, right = 0, imu = 0;
  double gravity = 0.0;
  while (auto message = dataset->next()) {
    if (const auto* frame = std::get_if<Frame>(&*message))
      ++(frame->camera == "cam0" ? left : right);
    if (const auto* sample = std::get_if<ImuSample>(&*message)) {
      ++imu;
      gravity += sample->accel.z();
    }
  }
  EXPECT_EQ(left, 154U);
  EXPECT_EQ(right, 154U);
  EXPECT_EQ(imu, 154U);
  EXPECT_NEAR(gravity / 154.0, 9.81, 0.2);
}

TEST_F(RealData, LabelledCentresProjectIntoTheirLabelledBoxes) {
  const fs::path tracking = root() / "kitti_tracking";
  auto calibration = readTrackingCalibration(tracking / "calib/0001.txt");
  calibration.width = 1242, calibration.height = 375;
  const CameraModel camera(calibration.camera("cam0"));
  const RigidTransform T_CR = camera.T_BC().inverse() * calibration.T_RI.inverse();
  std::size_t inside = 0, all = 0;
  for (const auto& label : readKittiLabels(tracking / "label_02/0001.txt")) {
    if (label.type != "Car" || label.truncated != 0) continue;
    const auto pixel = camera.project(T_CR * label.centre);
    ++all;
    inside += pixel && pixel->x() > label.box.x1 && pixel->x() < label.box.x2 &&
              pixel->y() > label.box.y1 && pixel->y() < label.box.y2;
  }
  EXPECT_GT(all, 1000U);
  EXPECT_EQ(inside, all);
}

TEST_F(RealData, TheStandingVehicleHas95FramesAndItsWholeImu) {
  const auto dataset = Dataset::open({.path = root() / "euroc_V101_static"});
  EXPECT_EQ(dataset->frameCount(), 95U);
  std::size_t frames = 0, imu = 0;
  while (auto message = dataset->next()) {
    frames += std::holds_alternative<Frame>(*message);
    imu += std::holds_alternative<ImuSample>(*message);
  }
  EXPECT_EQ(frames, 95U);
  EXPECT_GT(imu, 29000U);
  EXPECT_TRUE(dataset->reasons().all().empty());
}

// With this up vector, floor and table of the red kitchen are level: the heights over all depth
// images have two peaks, 4 cm wide and 0.71 m apart.
TEST_F(RealData, TheRedKitchenStandsUpright) {
  const fs::path scene = root() / "scenes7_redkitchen";
  if (!fs::is_directory(scene)) GTEST_SKIP() << scene << " is absent";
  const auto dataset = Dataset::open({.path = scene, .decode = false});
  EXPECT_EQ(dataset->frameCount(), 1000U);
  EXPECT_EQ(dataset->truth()->poses().size(), 1000U);
  EXPECT_TRUE(dataset->reasons().all().empty());
  Eigen::Matrix4d T_PD;
  std::ifstream file(scene / "pose/000000.txt");
  for (Eigen::Index i = 0; i < 16; ++i) file >> T_PD(i / 4, i % 4);
  const Eigen::Matrix3d R_WP = dataset->truth()->poses().front().T_WB.R() *
                               dataset->calibration().cameras.front().T_BC.R() *
                               T_PD.topLeftCorner<3, 3>().transpose();
  const Eigen::Vector3d measured = Eigen::Vector3d(0.007278, -0.892359, -0.451268).normalized();
  EXPECT_GT((R_WP * measured).z(), std::cos(1.0 * 3.14159265 / 180.0));
}

}  // namespace
}  // namespace perdure::replay
