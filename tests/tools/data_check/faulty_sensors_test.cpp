// Faults of the gyroscope, and images that are mirrored or upside down.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
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

TEST(FaultySensors, AnAxisOfTheGyroscopeWithAnotherScaleIsNamed) {
  TurningDrive drive;
  drive.seconds = 6.0;
  EXPECT_EQ(findingIn(makeTurningDrive("scaled", drive), "gyro_axis_factor"), "none");
  drive.change = [](ImuSample& sample) { sample.gyro.z() *= 0.5; };
  EXPECT_THAT(findingIn(makeTurningDrive("scaled", drive), "gyro_axis_factor"),
              HasSubstr("w_z is 0.5"));
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

/// A drive with noise, whose i-th sample is changed by `change`.
fs::path noisyDrive(const char* name, const std::function<void(ImuSample&, int)>& change) {
  std::mt19937_64 random(2);
  std::normal_distribution<double> noise(0.0, 0.002);
  TurningDrive drive;
  drive.seconds = 4.0;
  int count = 0;
  drive.change = [&](ImuSample& sample) {
    for (int i = 0; i < 3; ++i) sample.gyro[i] += noise(random), sample.accel[i] += noise(random);
    change(sample, count++);
  };
  return makeTurningDrive(name, drive);
}

TEST(FaultySensors, AnAxisThatKeepsOneValueIsStuck) {
  const auto sound = noisyDrive("not_stuck", [](ImuSample& sample, int i) {
    if (i >= 100 && i < 150) sample.accel.z() = 9.7;
  });
  EXPECT_EQ(findingIn(sound, "imu_axis_stuck"), "none");
  const auto all = noisyDrive("stuck", [](ImuSample& sample, int) { sample.accel.z() = 9.7; });
  EXPECT_THAT(findingIn(all, "imu_axis_stuck"),
              HasSubstr("the accelerometer reads exactly 9.7 m/s² along z from"));
  const auto half = noisyDrive("stuck_later", [](ImuSample& sample, int i) {
    if (i >= 400) sample.gyro.x() = 0.0;
  });
  EXPECT_THAT(findingIn(half, "imu_axis_stuck"), HasSubstr("cut the drive there"));
  EXPECT_EQ(findingIn(half, "gyro_axes"), "none");
}

TEST(FaultySensors, SingleSamplesFarFromTheirNeighboursAreSpikes) {
  const auto shock = noisyDrive("shock", [](ImuSample& sample, int i) {
    if (i >= 300 && i < 304) sample.accel.z() += i % 2 == 0 ? 150.0 : -120.0;
  });
  EXPECT_EQ(findingIn(shock, "imu_spike"), "none");
  const auto drive = noisyDrive("spike", [](ImuSample& sample, int i) {
    if (i == 300 || i == 350) sample.gyro.y() = 1e5;
  });
  EXPECT_THAT(findingIn(drive, "imu_spike"), HasSubstr("(and 1 more) reads 1e+05 rad/s about y"));
  EXPECT_EQ(findingIn(drive, "gyro_scale"), "none");
}

/// Changes the images of the second half.
fs::path changedFromHalf(const std::string& name, const TurningDrive& drive,
                         const std::function<cv::Mat(const cv::Mat&)>& change) {
  const auto root = makeTurningDrive(name, drive);
  std::vector<fs::path> images;
  for (const auto& entry : fs::directory_iterator(root / "mav0/cam0/data"))
    images.push_back(entry.path());
  std::ranges::sort(images);
  for (std::size_t i = images.size() / 2; i < images.size(); ++i) {
    cv::imwrite(images[i].string(), change(cv::imread(images[i].string(), cv::IMREAD_GRAYSCALE)));
  }
  return root;
}

TEST(FaultySensors, ImagesThatAreMirroredFromMidDriveOnAreNamedWithTheTime) {
  TurningDrive drive;
  drive.seconds = 8.0;
  const auto root = changedFromHalf("flipped_from_half", drive, [](const cv::Mat& image) {
    cv::Mat flipped;
    cv::flip(image, flipped, 1);
    return flipped;
  });
  EXPECT_THAT(findingIn(root, "images_flipped"),
              testing::AllOf(HasSubstr("something changes in mid-drive: only from about 100000000"),
                             HasSubstr("mirrored left to right")));
}

TEST(FaultySensors, ImagesInReverseOrderFromMidDriveOnAreNamedWithTheTime) {
  TurningDrive drive;
  drive.seconds = 16.0;
  std::vector<cv::Mat> later;
  const auto keep = [&](const cv::Mat& image) { return later.emplace_back(image.clone()); };
  changedFromHalf("reversed_from_half", drive, keep);
  const auto last = [&](const cv::Mat&) {
    const cv::Mat image = later.back();
    later.pop_back();
    return image;
  };
  EXPECT_THAT(findingIn(changedFromHalf("reversed_from_half", drive, last), "images_backwards"),
              testing::AllOf(HasSubstr("something changes in mid-drive: only from about 100000000"),
                             HasSubstr("listed in reverse order")));
}

TEST(FaultySensors, ImagesThatChangeTheirSizeAreNamedWithTheFrame) {
  const auto root = changedFromHalf("size_from_half", {}, [](const cv::Mat& image) {
    cv::Mat half;
    cv::resize(image, half, {image.cols / 2, image.rows / 2});
    return half;
  });
  EXPECT_THAT(findingIn(root, "images_change_size"),
              HasSubstr("change from 160x120 to 80x60 at frame 20 of 4"));
}

/// A change of some samples, counted from 0.
auto fromTo(int first, int last, const std::function<void(ImuSample&)>& change) {
  return [=, number = 0](ImuSample& sample) mutable {
    if (number >= first && number < last) change(sample);
    ++number;
  };
}

TEST(FaultySensors, ABlockOfCorruptSamplesIsNamed) {
  TurningDrive drive;
  drive.change = fromTo(200, 206, [](ImuSample& sample) { sample.gyro.z() = 8.0; });
  EXPECT_THAT(findingIn(makeTurningDrive("gyro_block", drive), "imu_block"),
              HasSubstr("gyroscope reads 8 rad/s about z in 6 samples from 1000000001000000000 ns "
                        "(number 201)"));
  drive.change = fromTo(100, 103, [](ImuSample& sample) { sample.accel.setConstant(80.0); });
  EXPECT_THAT(findingIn(makeTurningDrive("accel_block", drive), "imu_block"),
              HasSubstr("accelerometer reads 80 m/s² about x, y, z in 3 samples"));
}

TEST(FaultySensors, AShockOfBothSensorsIsNoCorruptBlock) {
  TurningDrive drive;
  drive.change = fromTo(200, 203, [](ImuSample& sample) {
    sample.gyro.z() = 8.0;
    sample.accel.x() += 70.0;
  });
  EXPECT_EQ(findingIn(makeTurningDrive("shock", drive), "imu_block"), "none");
}

TEST(FaultySensors, AnAxisThatIsAlwaysAtTheLimitIsSaturated) {
  TurningDrive drive;
  drive.change = [](ImuSample& sample) {
    sample.accel = sample.accel.cwiseMin(9.0).cwiseMax(-9.0);
  };
  EXPECT_THAT(findingIn(makeTurningDrive("limit", drive), "imu_saturated"),
              HasSubstr("reads exactly 9 m/s²"));
}

}  // namespace
}  // namespace perdure::tools
