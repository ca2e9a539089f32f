#include "tools/data_check/pair_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/core.hpp>
#include <sstream>

#include "common/math/so3.h"
#include "common/sim/dice.h"
#include "tests/common/replay/tiny_datasets.h"
#include "tests/support/camera.h"
#include "tools/data_check/axis_changes.h"
#include "tools/data_check/data_check.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;
using replay::Dataset;
using testing::HasSubstr;

/// Returns the text of the finding with this code; empty if there is none.
std::string textOf(const replay::DataFindings& findings, const std::string& code) {
  for (const auto& finding : findings) {
    if (finding.code == code) return finding.text;
  }
  return {};
}
replay::DataFindings pairsIn(const fs::path& root) {
  return checkPairs(Dataset::open({.path = root})->recording());
}

/// Changes the stamps in cam1's list, and keeps only each `every`-th line.
fs::path withList(const std::string& name, std::int64_t later_ns, int every = 1) {
  const fs::path root = replay::tinyEuroc(name, true);
  const fs::path file = root / "mav0/cam1/data.csv";
  std::istringstream lines(replay::readText(file));
  std::string changed, line;
  for (int i = 0; std::getline(lines, line);) {
    const auto comma = line.find(',');
    if (line.starts_with('#') || comma == std::string::npos) continue;
    if (i++ % every != 0) continue;
    changed += std::to_string(std::stoll(line) + later_ns) + line.substr(comma) + "\n";
  }
  replay::writeText(file, changed);
  return root;
}

TEST(PairCheck, ASoundPairHasNoFinding) {
  EXPECT_TRUE(pairsIn(replay::tinyEuroc("pairs", true)).empty());
}

TEST(PairCheck, StampsWithoutAPartnerAreToldByHowFarTheyAre) {
  EXPECT_THAT(textOf(pairsIn(withList("late", 12'000'000)), "stereo_unpaired"),
              HasSubstr("12.0 ms too late"));
  const auto apart = textOf(pairsIn(withList("hour", 3600'000'000'000)), "stereo_unpaired");
  EXPECT_THAT(apart, HasSubstr("none of the frames of cam0 (0 of 5)"));
  EXPECT_THAT(apart, HasSubstr("3600.00 s too late"));
}

TEST(PairCheck, FramesThatCam1LacksAreCounted) {
  EXPECT_THAT(textOf(pairsIn(withList("lost", 0, 2)), "stereo_unpaired"),
              HasSubstr("only 60 % of the frames of cam0 (3 of 5)"));
}

TEST(PairCheck, FilesThatAreMissingAreCountedWithoutOpenCvsOwnLines) {
  const fs::path root = replay::tinyEuroc("missing", true);
  const auto recording = Dataset::open({.path = root})->recording();
  int removed = 0;
  for (const auto& frame : recording.frames) {
    if (frame.camera == 1 && removed < 3) removed += fs::remove(frame.path) ? 1 : 0;
  }
  testing::internal::CaptureStderr();
  const auto findings = checkDrive(recording, {});
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  EXPECT_THAT(textOf(findings, "images_missing"), HasSubstr("3 of the 5 images of cam1 (60 %)"));
}

TEST(PairCheck, APlaceInMillimetresIsNamed) {
  replay::Recording recording;
  recording.calibration.cameras = {tests::cameraAhead(320, 240, 220.0, {60.0, 60.0, 50.0})};
  recording.calibration.imu.emplace();
  EXPECT_THAT(textOf(checkPairs(recording), "T_BS_in_mm"),
              HasSubstr("98.5 m from the IMU: is its position in millimetres?"));
  recording.calibration.cameras[0].T_BC.p *= 1e-3;
  EXPECT_TRUE(checkPairs(recording).empty());
}

TEST(PairCheck, AnExceptionOfOpenCvIsAFinding) {
  auto recording = Dataset::open({.path = replay::tinyEuroc("throws", true)})->recording();
  for (auto& frame : recording.frames) {
    frame.load = []() -> Result<Frame> { throw cv::Exception(1, "sizes", "calc", "file", 1); };
  }
  EXPECT_THAT(textOf(checkDrive(recording, {}), "check_failed"), HasSubstr("sizes"));
}

using Change = std::function<Eigen::Vector3d(const Eigen::Vector3d&)>;

const CameraCalibration kAhead = tests::cameraAhead(320, 240, 220.0);

struct Sides {
  std::vector<Turn> turns;
  std::vector<ImuSample> samples;
};

/// A car that rotates about z, and hardly about x and y; `change` is applied to its gyroscope.
Sides turningCar(const Change& change) {
  sim::Dice dice(4);
  Sides sides;
  Eigen::Vector3d rate = Eigen::Vector3d::Zero();
  for (int i = 0; i < 120; ++i) {
    const Eigen::Vector3d other(dice.normal(), dice.normal(), dice.normal());
    rate = 0.5 * rate + Eigen::Vector3d(0.01, 0.01, 0.05).cwiseProduct(other);
    Turn turn;
    turn.from = fromNanoseconds(50'000'000LL * i),
    turn.to = fromNanoseconds(50'000'000LL * (i + 1));
    const Eigen::Vector3d noise(dice.normal(), dice.normal(), dice.normal());
    turn.of_images = 0.05 * (kAhead.T_BC.q.conjugate() * (rate + 0.004 * noise));
    sides.turns.push_back(turn);
    for (int k = 0; k < 10; ++k) {
      ImuSample sample;
      sample.time = turn.from + std::chrono::milliseconds(5 * k);
      sample.gyro = change(rate);
      sides.samples.push_back(sample);
    }
  }
  return sides;
}

replay::DataFindings axesOf(const Change& change) {
  const Sides sides = turningCar(change);
  return judgeAxisChanges(sides.turns, sides.samples, kAhead);
}

bool agrees(const Change& change) {
  const Sides sides = turningCar(change);
  return axesSurelyAgree(sides.turns, sides.samples, kAhead);
}

TEST(AxisChanges, AnExchangeIsHeardBesideTheAxisThatTurnsMost) {
  EXPECT_TRUE(axesOf([](const auto& w) { return w; }).empty());
  EXPECT_THAT(textOf(axesOf([](const auto& w) { return Eigen::Vector3d(w.y(), w.x(), w.z()); }),
                     "gyro_axes"),
              HasSubstr("the gyroscope's y, x, z"));
  EXPECT_THAT(textOf(axesOf([](const auto& w) { return Eigen::Vector3d(-w.x(), w.y(), w.z()); }),
                     "gyro_axes"),
              HasSubstr("the gyroscope's −x, y, z"));
}

TEST(AxisChanges, AreSurelyRightWhereEachAxisTurnsAsTheImagesDo) {
  EXPECT_TRUE(agrees([](const auto& w) { return w; }));
  EXPECT_FALSE(agrees([](const auto& w) { return Eigen::Vector3d(w.y(), w.x(), w.z()); }));
  EXPECT_FALSE(agrees([](const auto& w) { return Eigen::Vector3d(-w.x(), w.y(), w.z()); }));
  EXPECT_FALSE(agrees([](const auto& w) { return Eigen::Vector3d(0.0, 0.0, w.z()); }));
}

}  // namespace
}  // namespace perdure::tools
