// Faults of the gyroscope, and images that are mirrored or upside down.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>
#include <random>

#include "tests/tools/data_check/turning_drive.h"
#include "tools/data_check/data_check.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using tests::makeTurningDrive;
using tests::TurningDrive;

/// The text of the first finding with this code, or "none".
std::string findingIn(const fs::path& root, const std::string& code) {
  const auto dataset = replay::Dataset::open({.path = root});
  for (const auto& one : checkDrive(dataset->recording(), {})) {
    if (one.code == code) return one.text;
  }
  return "none";
}

TEST(FaultySensors, FlippedImagesAreNamedByTheAxesThatTurnWrongly) {
  TurningDrive drive;
  drive.seconds = 6.0;
  for (const auto& [flip, name] : {std::pair(1, "mirrored left to right"),
                                   {0, "mirrored top to bottom"},
                                   {-1, "upside down"}}) {
    const auto root = makeTurningDrive("flipped", drive);
    for (const auto& entry : fs::directory_iterator(root / "mav0/cam0/data")) {
      const cv::Mat image = cv::imread(entry.path().string(), cv::IMREAD_GRAYSCALE);
      cv::Mat flipped;
      cv::flip(image, flipped, flip);
      cv::imwrite(entry.path().string(), flipped);
    }
    const auto text = findingIn(root, "images_flipped");
    EXPECT_THAT(text, HasSubstr(name));
    EXPECT_EQ(text.find(", or mirrored"), std::string::npos) << text;
  }
  EXPECT_EQ(findingIn(makeTurningDrive("not_flipped", drive), "images_flipped"), "none");
}

TEST(FaultySensors, AnAxisOfTheGyroscopeThatIsOffIsNamed) {
  TurningDrive drive;
  drive.change = [](ImuSample& sample) { sample.gyro.z() = 0.013; };
  EXPECT_THAT(findingIn(makeTurningDrive("axis_off", drive), "gyro_axis_constant"),
              HasSubstr("w_z is 0.013 rad/s in all 401 samples while the images turn"));
}

TEST(FaultySensors, ThousandthsOfADegreeAreNoDegrees) {
  TurningDrive drive;
  drive.turning = 0.004;  // a device that is held still
  drive.gyro_bias.setZero();
  drive.change = [](ImuSample& sample) { sample.gyro *= 1e3 * 180.0 / M_PI; };
  for (const double turning : {0.004, 0.4}) {
    drive.turning = turning;
    const auto root = makeTurningDrive("thousandths", drive);
    EXPECT_EQ(findingIn(root, "gyro_in_degrees"), "none");
    EXPECT_THAT(findingIn(root, "gyro_scale"), HasSubstr("thousandths of a degree per second"));
  }
}

TEST(FaultySensors, AGyroscopeThatStaysAtItsLargestValueIsSaturated) {
  std::mt19937_64 random(2);
  std::normal_distribution<double> noise(0.0, 0.002);
  TurningDrive drive;
  drive.turning = 0.25;
  const auto add = [&](ImuSample& sample) {
    for (int i = 0; i < 3; ++i) sample.gyro[i] += noise(random), sample.accel[i] += noise(random);
  };
  drive.change = add;
  EXPECT_EQ(findingIn(makeTurningDrive("not_saturated", drive), "imu_saturated"), "none");
  drive.change = [&](ImuSample& sample) {
    add(sample);
    sample.gyro.z() = std::clamp(sample.gyro.z(), -0.2, 0.2);
  };
  EXPECT_THAT(findingIn(makeTurningDrive("saturated", drive), "imu_saturated"),
              HasSubstr("the gyroscope reads exactly ±0.2 rad/s about z in"));
}

}  // namespace
}  // namespace perdure::tools
