#include "tools/calibrate/motion/from_motion.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "common/math/so3.h"
#include "tests/tools/calibrate/motion/moving_camera.h"
#include "tests/tools/data_check/turning_drive.h"

namespace perdure::calibrate {
namespace {

using tests::moveCamera;
using tests::MovingCamera;
using tests::phoneWith;

constexpr double kDegrees = 180.0 / M_PI;
constexpr double kFree = std::numeric_limits<double>::infinity();

/// Starts with a lens without distortion, a turned mounting, no offset and no readout.
JointEstimate estimated(const MovingCamera& moving, double focal_factor) {
  JointOptions options{moving.truth, {}};
  CameraCalibration& start = options.prior.camera;
  start.fx *= focal_factor, start.fy *= focal_factor;
  start.cx = 319.5, start.cy = 239.5;
  start.distortion_coefficients.assign(4, 0.0);
  start.T_BC.q = start.T_BC.q * expQuaternion(Eigen::Vector3d(0.05, -0.04, 0.03));
  start.T_BC.p.setZero();
  start.time_offset_s -= 0.005, start.readout_s = 0.0;
  options.prior.gyro_bias.setZero();
  options.prior_sigma << kFree, kFree, kFree, kFree, 0.03, 0.05, 0.05, 0.05, kFree, 6.4, 6.4, 0.2,
      0.1, 0.05, 0.05, 0.05;
  return estimateJointly(moving.windows, moving.samples, options);
}

TEST(MotionJoint, FindsLensMountingAndTimesFromAWrongStart) {
  const auto moving = moveCamera({.truth = phoneWith(480.0, -0.04, 0.03)});
  for (const double factor : {0.85, 1.15}) {
    const auto found = estimated(moving, factor);
    const JointVector error = between(moving.truth, found.state);
    EXPECT_LT(std::abs(error[kFocal]), 0.01);
    EXPECT_LT(kDegrees * error.head<3>().norm(), 0.5);
    EXPECT_LT(std::abs(error[kLater]), 0.003);
    EXPECT_LT(std::abs(error[kReadout]), 0.003);
    EXPECT_LT(error.segment<3>(kBias).norm(), 0.01);
  }
}

TEST(MotionJoint, StatesHonestDeviations) {
  double squares = 0.0;
  int count = 0;
  for (std::uint32_t seed = 1; seed <= 6; ++seed) {
    const auto moving = moveCamera({.truth = phoneWith(480.0, -0.04, 0.03), .seed = seed});
    const auto found = estimated(moving, 1.05);
    const JointVector error = between(moving.truth, found.state).cwiseQuotient(found.sigma);
    for (const int i : {+kFocal, +kLater, +kReadout, +kTurnOf, kTurnOf + 1, kTurnOf + 2}) {
      squares += error[i] * error[i];
      ++count;
    }
  }
  EXPECT_GT(squares / count, 0.2);
  EXPECT_LT(squares / count, 2.0);
}

TEST(MotionJoint, KeepsTheReadoutAtItsPriorWhereNothingTurns) {
  const auto moving = moveCamera(
      {.truth = phoneWith(480.0, 0.0, 0.03), .windows = 8, .way_m = 0.0, .turning = {0, 0, 0}});
  EXPECT_GT(estimated(moving, 1.0).sigma[kReadout], 0.02);
}

TEST(MotionJoint, FindsTheOffsetOfEachWindow) {
  auto moving = moveCamera({.truth = phoneWith(480.0, 0.0, 0.0), .windows = 12});
  for (std::size_t i = 6; i < 12; ++i) {
    for (TimePoint& time : moving.windows[i].times) time += std::chrono::milliseconds(30);
  }
  const auto offsets = estimated(moving, 1.0).offsets;
  ASSERT_EQ(offsets.size(), 12u);
  for (std::size_t i = 0; i < 12; ++i) {
    const double change = offsets[i].offset_s - offsets[0].offset_s;
    EXPECT_NEAR(change, i < 6 ? 0.0 : -0.03, 0.012) << i;
  }
}

/// All rotations that map axes to axes.
std::vector<Eigen::Matrix3d> mountings() {
  std::vector<Eigen::Matrix3d> all;
  for (int x = 0; x < 6; ++x) {
    for (int y = 0; y < 6; ++y) {
      if (x / 2 == y / 2) continue;
      Eigen::Matrix3d R;
      R.col(0) = (x % 2 ? -1.0 : 1.0) * Eigen::Vector3d::Unit(x / 2);
      R.col(1) = (y % 2 ? -1.0 : 1.0) * Eigen::Vector3d::Unit(y / 2);
      R.col(2) = R.col(0).cross(R.col(1));
      all.push_back(R);
    }
  }
  return all;
}

TEST(MotionGuess, FindsFocalLengthOffsetAndEachMounting) {
  ASSERT_EQ(mountings().size(), 24u);
  double focal = 320.0;
  for (const Eigen::Matrix3d& R : mountings()) {
    auto moving = moveCamera({.truth = phoneWith(focal, 0.06, 0.0), .windows = 6});
    for (ImuSample& sample : moving.samples) sample.gyro = R * sample.gyro;
    CameraCalibration size;
    size.width = 640, size.height = 480;
    const auto guess = guessFromTurns(moving.windows, moving.samples, size);
    EXPECT_NEAR(guess.camera.fx / focal, 1.0, 0.25);
    EXPECT_NEAR(guess.camera.time_offset_s, 0.06, 0.02);
    const Eigen::Quaterniond truth(R * moving.truth.camera.T_BC.q.toRotationMatrix());
    EXPECT_LT(kDegrees * logSo3(Eigen::Quaterniond(truth.conjugate() * guess.camera.T_BC.q)).norm(),
              12.0);
    focal *= 1.06;  // to two widths
  }
}

Result<MotionRig> rigOf(const std::string& name, const tests::TurningDrive& drive) {
  const auto dataset = replay::Dataset::open({.path = tests::makeTurningDrive(name, drive)});
  return rigFromMotion(dataset->recording(), {});
}

TEST(MotionRig, IsFoundInImagesOfAWrongCalibration) {
  tests::TurningDrive drive;
  drive.seconds = 8.0;
  drive.images_late = std::chrono::milliseconds(30);
  drive.written_T_BC = RigidTransform{};
  const auto found = rigOf("from_motion", drive);
  ASSERT_TRUE(found) << found.error().detail;
  const CameraCalibration& camera = found->rig.cameras.front();
  EXPECT_NEAR(camera.fx, 110.0, 1.1);
  EXPECT_NEAR(camera.time_offset_s, -0.030, 0.003);
  const Eigen::Quaterniond off(tests::trueCameraPlace().q.conjugate() * camera.T_BC.q);
  EXPECT_LT(kDegrees * logSo3(off).norm(), 0.7);
  const auto lines = linesOf(*found);
  EXPECT_NE(lines.front().find("focal length"), std::string::npos);
  // The drive turns on the spot and has no rolling shutter.
  EXPECT_LT(std::abs(camera.readout_s), 0.005);
}

TEST(MotionRig, IsRefusedWithoutTurning) {
  tests::TurningDrive drive;
  drive.seconds = 5.0, drive.turning = 0.0;
  const auto found = rigOf("from_motion_still", drive);
  ASSERT_FALSE(found);
  EXPECT_EQ(found.error().code, "motion_no_rotation");
}

TEST(MotionRig, IsRefusedWithAMirroredGyroscope) {
  for (const Eigen::Vector3d& signs :
       {Eigen::Vector3d(1, -1, 1), Eigen::Vector3d(1, 1, -1), Eigen::Vector3d(-1, -1, -1)}) {
    tests::TurningDrive drive;
    drive.seconds = 5.0;
    drive.change = [&](ImuSample& sample) { sample.gyro = sample.gyro.cwiseProduct(signs); };
    const auto found = rigOf("from_motion_mirrored", drive);
    ASSERT_FALSE(found);
    EXPECT_EQ(found.error().code, "motion_mirrored");
  }
}

TEST(MotionRig, IsRefusedWithTheGyroscopeOfAnotherDrive) {
  tests::TurningDrive drive;
  drive.seconds = 5.0;
  int count = 0;
  drive.change = [&](ImuSample& sample) {
    const double t = 0.005 * count++;
    sample.gyro = Eigen::Vector3d(std::sin(7.9 * t), std::cos(2.1 * t), std::sin(6.1 * t + 2.0));
  };
  const auto found = rigOf("from_motion_other", drive);
  ASSERT_FALSE(found);
  EXPECT_EQ(found.error().code, "motion_apart");
}

TEST(MotionCheck, NamesAWrongFocalLengthOffsetAndReadout) {
  auto check = [](const std::string& name, auto change) {
    tests::TurningDrive drive;
    drive.seconds = 8.0;
    const auto dataset = replay::Dataset::open({.path = tests::makeTurningDrive(name, drive)});
    replay::Recording recording = dataset->recording();
    change(recording.calibration.cameras.front());
    std::string codes;
    for (const auto& finding : checkMotion(recording).findings) codes += finding.code + " ";
    return codes;
  };
  EXPECT_EQ(check("motion_sound", [](CameraCalibration&) {}), "");
  EXPECT_EQ(check("motion_focal", [](CameraCalibration& c) { c.fx *= 1.05, c.fy *= 1.05; }),
            "focal_length ");
  EXPECT_EQ(check("motion_late", [](CameraCalibration& c) { c.time_offset_s = 0.03; }),
            "time_offset ");
  EXPECT_EQ(check("motion_rows", [](CameraCalibration& c) { c.readout_s = 0.03; }), "readout ");
}

TEST(MotionCheck, NamesAGyroscopeWhoseBiasChangesInMidDrive) {
  tests::TurningDrive drive;
  drive.seconds = 12.0;
  drive.change = [number = 0](ImuSample& sample) mutable {
    constexpr int kMiddle = 1200;
    if (number++ >= kMiddle) sample.gyro.x() += 0.2;
  };
  const auto root = tests::makeTurningDrive("motion_bias", drive);
  const auto found = checkMotion(replay::Dataset::open({.path = root})->recording()).findings;
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found.front().code, "rig_changes");
  EXPECT_NE(found.front().text.find("the bias of the gyroscope changes by 0.2"), std::string::npos)
      << found.front().text;
}

}  // namespace
}  // namespace perdure::calibrate
