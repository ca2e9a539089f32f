#include "tools/data_check/repaired_copy.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>

#include "common/base/errors.h"
#include "common/math/so3.h"
#include "tests/tools/data_check/turning_drive.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;
using replay::Dataset;
using testing::HasSubstr;
using testing::SizeIs;
using tests::makeTurningDrive;
using tests::TurningDrive;

fs::path newFolder(const std::string& name) {
  const fs::path folder = fs::temp_directory_path() / "perdure_repaired" / name;
  fs::remove_all(folder);
  return folder;
}

/// Writes the fixed copy of a drive and reads it again.
replay::Recording repaired(const std::string& name, const TurningDrive& drive,
                           std::size_t fixes = 1) {
  const auto root = makeTurningDrive("to_fix_" + name, drive);
  const RepairedDrive result = repairDrive(Dataset::open({.path = root})->recording());
  EXPECT_THAT(result.fixes, SizeIs(fixes));
  EXPECT_THAT(result.left, SizeIs(0));
  const fs::path copy = newFolder(name);
  EXPECT_EQ(writeDrive(result.recording, copy), 0U);
  return Dataset::open({.path = copy})->recording();
}

replay::Recording sound() {
  return Dataset::open({.path = makeTurningDrive("to_fix_sound")})->recording();
}

/// Returns the largest difference between the samples of two recordings.
double largestDifference(const replay::Recording& a, const replay::Recording& b) {
  EXPECT_EQ(a.imu.size(), b.imu.size());
  double largest = 0.0;
  for (std::size_t i = 0; i < std::min(a.imu.size(), b.imu.size()); ++i) {
    EXPECT_EQ(a.imu[i].time, b.imu[i].time);
    largest = std::max({largest, (a.imu[i].gyro - b.imu[i].gyro).norm(),
                        (a.imu[i].accel - b.imu[i].accel).norm()});
  }
  return largest;
}

TEST(RepairedCopy, AForceInGIsOneInMetresAndTheImagesAreTheSame) {
  TurningDrive drive;
  drive.change = [](ImuSample& s) { s.accel /= 9.80665; };
  const auto copy = repaired("g", drive), truth = sound();
  EXPECT_LT(largestDifference(copy, truth), 1e-6);
  ASSERT_EQ(copy.frames.size(), truth.frames.size());
  for (std::size_t i = 0; i < copy.frames.size(); ++i) {
    EXPECT_EQ(copy.frames[i].time, truth.frames[i].time);
    EXPECT_EQ(fs::file_size(copy.frames[i].path), fs::file_size(truth.frames[i].path));
  }
  EXPECT_EQ(copy.calibration.cameras.front().fx, truth.calibration.cameras.front().fx);
}

TEST(RepairedCopy, SeveralFaultsAreRepairedOneAfterTheOther) {
  TurningDrive drive;
  drive.change = [](ImuSample& s) {
    s.accel /= 9.80665;
    s.gyro *= 180.0 / M_PI;
  };
  EXPECT_LT(largestDifference(repaired("two", drive, 2), sound()), 1e-6);
}

TEST(RepairedCopy, ColumnsAreExchangedAndTheTransformIsTurnedRound) {
  TurningDrive exchanged;
  exchanged.change = [](ImuSample& s) { std::swap(s.gyro, s.accel); };
  EXPECT_LT(largestDifference(repaired("columns", exchanged), sound()), 1e-6);
  TurningDrive inverted;
  inverted.written_T_BC = tests::trueCameraPlace().inverse();
  const auto copy = repaired("inverted", inverted);
  const RigidTransform off =
      copy.calibration.cameras.front().T_BC.inverse() * tests::trueCameraPlace();
  EXPECT_LT(logSo3(off.R()).norm() + off.p.norm(), 1e-6);
}

TEST(RepairedCopy, WhatIsNotSureIsLeftAndSaid) {
  TurningDrive drive;
  drive.change = [](ImuSample& s) { s.gyro *= M_PI / 180.0; };  // for an unknown reason
  const auto root = makeTurningDrive("to_fix_unsure", drive);
  const RepairedDrive result = repairDrive(Dataset::open({.path = root})->recording());
  EXPECT_THAT(result.fixes, SizeIs(0));
  ASSERT_THAT(result.left, SizeIs(1));
  EXPECT_EQ(result.left.front().code, "gyro_too_small");
}

TEST(RepairedCopy, AFolderThatHoldsSomethingIsNotTouched) {
  const fs::path folder = newFolder("full");
  fs::create_directories(folder);
  std::ofstream(folder / "mine") << "1";
  try {
    writeDrive(sound(), folder);
    FAIL() << "it was written";
  } catch (const StartupError& error) {
    EXPECT_EQ(error.code(), ExitCode::kUsage);
    EXPECT_THAT(error.what(), HasSubstr("give another name"));
  }
  EXPECT_EQ(std::distance(fs::directory_iterator(folder), fs::directory_iterator()), 1);
}

TEST(RepairedCopy, TheDriveItselfIsNotWrittenInto) {
  const auto recording = sound();
  const fs::path images = fs::path(recording.frames.front().path).parent_path();
  for (const fs::path& copy : {images / "copy", images.parent_path() / "copy"}) {
    try {
      writeDrive(recording, copy);
      FAIL() << "it was written";
    } catch (const StartupError& error) {
      EXPECT_EQ(error.code(), ExitCode::kUsage);
      EXPECT_THAT(error.what(), HasSubstr("lies in the data"));
    }
    EXPECT_FALSE(fs::exists(copy));
  }
}

TEST(RepairedCopy, AnImageThatIsGoneIsLeftOutAndCounted) {
  auto recording = sound();
  recording.frames.front().path = "/nonexistent.png";
  const fs::path folder = newFolder("gone");
  EXPECT_EQ(writeDrive(recording, folder), 1U);
  EXPECT_EQ(Dataset::open({.path = folder})->recording().frames.size(),
            recording.frames.size() - 1);
}

}  // namespace
}  // namespace perdure::tools
