#include "tools/data_check/clock_shift.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "common/math/so3.h"
#include "tools/data_check/turn_integral.h"

namespace perdure::tools {
namespace {

using std::chrono::milliseconds, std::chrono::seconds;
using testing::HasSubstr;

constexpr TimePoint kStart = TimePoint(seconds(1'700'000'000));

/// A body that turns at random for 90 s: rates at 100 Hz, smooth over half a second.
std::vector<ImuSample> randomTurning(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> push(0.0, 0.15);
  std::vector<ImuSample> samples;
  Eigen::Vector3d rate = Eigen::Vector3d::Zero();
  for (int i = 0; i < 9000; ++i) {
    for (int axis = 0; axis < 3; ++axis) rate(axis) += push(random);
    rate *= 0.98;
    ImuSample sample;
    sample.time = kStart + i * milliseconds(10);
    sample.gyro = rate;
    samples.push_back(sample);
  }
  return samples;
}

CameraCalibration camera() {
  CameraCalibration calibration;
  calibration.name = "cam0", calibration.fx = 300.0;
  calibration.T_BC.q = Eigen::Quaterniond(0.5, -0.5, 0.5, -0.5);
  return calibration;
}

/// Rotations that the camera shows in eight parts of the drive, with its noise; the stamps are
/// `ahead`.
std::vector<Turn> turnsOf(const std::vector<ImuSample>& samples, Duration ahead) {
  const TurnIntegral gyro(samples);
  std::mt19937_64 random(5);
  std::normal_distribution<double> noise(0.0, 0.002);
  std::vector<Turn> turns;
  for (int part = 0; part < 8; ++part) {
    for (int i = 0; i < 15; ++i) {
      const TimePoint from = kStart + part * seconds(11) + i * milliseconds(50);
      const TimePoint to = from + milliseconds(50);
      const Eigen::Vector3d turn = camera().T_BC.q.conjugate() * gyro.between(from, to);
      turns.push_back({from + ahead, to + ahead,
                       turn + Eigen::Vector3d(noise(random), noise(random), noise(random))});
    }
  }
  return turns;
}

TEST(ClockShift, IsFoundWhateverItsSizeIs) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    const auto samples = randomTurning(seed);
    for (const double ahead : {-40.0, -3.0043, 0.0, 1.7, 18.0, 37.0, 44.0, 1e9}) {
      const auto shift =
          shiftOfTurns(turnsOf(samples, durationFromSeconds(ahead)), samples, camera());
      ASSERT_TRUE(shift) << ahead << " of seed " << seed;
      EXPECT_NEAR(*shift, -ahead, 0.003) << "seed " << seed;
    }
  }
}

TEST(ClockShift, IsNotFoundInTheTurningOfAnotherDrive) {
  EXPECT_FALSE(shiftOfTurns(turnsOf(randomTurning(1), seconds(3)), randomTurning(2), camera()));
}

TEST(ClockShift, IsNotCertainWhereTheTurningComesAgain) {
  auto samples = randomTurning(1);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const double angle = 2.0 * M_PI * static_cast<double>(i) / 200.0;  // every two seconds
    samples[i].gyro = {std::sin(angle), std::cos(angle), 0.5 * std::sin(2.0 * angle)};
  }
  EXPECT_FALSE(shiftOfTurns(turnsOf(samples, seconds(3)), samples, camera()));
}

TEST(ClockRate, IsFoundAndAConstantShiftIsNone) {
  const auto samples = randomTurning(1);
  for (const double rate : {-0.05, -0.01, 0.01, 0.03}) {
    auto turns = turnsOf(samples, milliseconds(200));
    for (Turn& turn : turns) {
      for (TimePoint* time : {&turn.from, &turn.to}) {
        *time = kStart + durationFromSeconds(toSeconds(*time - kStart) / (1.0 + rate));
      }
    }
    // A shift of over 1.5 s at the ends is not searched.
    turns.resize(std::abs(rate) > 0.02 ? 60 : turns.size());
    const auto found = rateOfTurns(turns, samples, camera());
    ASSERT_TRUE(found) << rate;
    EXPECT_NEAR(*found, rate, 0.002);
  }
  for (const double ahead : {0.0, 0.3, 5.0}) {
    EXPECT_FALSE(rateOfTurns(turnsOf(samples, durationFromSeconds(ahead)), samples, camera()));
  }
}

/// A recording of these samples, with images each 50 ms.
replay::Recording recordingOf(std::vector<ImuSample> samples) {
  replay::Recording recording;
  recording.imu = std::move(samples);
  recording.calibration.cameras = {camera()};
  recording.frames.resize(1800);
  for (int i = 0; i < 1800; ++i) {
    recording.frames[static_cast<std::size_t>(i)].time = kStart + i * milliseconds(50);
  }
  return recording;
}

TEST(ClockParts, AStepOfLessThanASecondIsFoundWithItsPlace) {
  const auto turns = turnsOf(randomTurning(1), Duration{0});
  const auto judged = [&](Duration imu_step, Duration image_step) {
    auto recording = recordingOf(randomTurning(1));
    const TimePoint at = kStart + seconds(41);
    for (auto& sample : recording.imu) sample.time += sample.time < at ? Duration{0} : imu_step;
    for (auto& frame : recording.frames) frame.time += frame.time < at ? Duration{0} : image_step;
    auto seen = turns;
    for (auto& turn : seen) {
      for (TimePoint* time : {&turn.from, &turn.to}) *time += *time < at ? Duration{0} : image_step;
    }
    return judgeParts(offsetsOfParts(seen, recording.imu, camera()), recording);
  };
  const auto of_imu = judged(milliseconds(150), Duration{0});
  ASSERT_EQ(of_imu.size(), 1U);
  EXPECT_THAT(of_imu[0].text,
              HasSubstr("at 1700000041150000000 ns the stamps of the IMU jump ahead by 0.150 s"));
  const auto of_images = judged(Duration{0}, milliseconds(120));
  ASSERT_EQ(of_images.size(), 1U);
  EXPECT_THAT(of_images[0].text, HasSubstr("the stamps of cam0 jump ahead by 0.120 s"));
  EXPECT_TRUE(judged(Duration{0}, Duration{0}).empty());
  EXPECT_TRUE(judged(milliseconds(150), milliseconds(150)).empty());
}

TEST(ClockParts, TwoStepsOfOneClockAreNoRate) {
  auto recording = recordingOf(randomTurning(1));
  auto turns = turnsOf(recording.imu, Duration{0});
  const auto late = [](TimePoint time) {
    return (time < kStart + seconds(30)   ? 0
            : time < kStart + seconds(60) ? 1
                                          : 2) *
           milliseconds(80);
  };
  for (auto& frame : recording.frames) frame.time += late(frame.time);
  for (auto& turn : turns) turn.from += late(turn.from), turn.to += late(turn.to);
  const auto found = judgeParts(offsetsOfParts(turns, recording.imu, camera()), recording);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_THAT(found[0].text, HasSubstr("jump ahead by 0.080 s, at"));
  EXPECT_THAT(found[0].text, HasSubstr("without these steps"));
}

TEST(ClockParts, MissingSamplesAreNamedWhileTheImagesGoOn) {
  auto recording = recordingOf(randomTurning(1));
  EXPECT_TRUE(checkImuGaps(recording).empty());
  std::erase_if(recording.imu, [](const ImuSample& sample) {
    return sample.time > kStart + seconds(30) && sample.time < kStart + milliseconds(30500);
  });
  const auto found = checkImuGaps(recording);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_THAT(found[0].text, HasSubstr("no inertial samples for 0.50 s from"));
}

TEST(ClockParts, AClockThatIsSlightlyFastIsFoundWithItsFactor) {
  const auto recording = recordingOf(randomTurning(2));
  auto turns = turnsOf(recording.imu, Duration{0});
  for (Turn& turn : turns) {
    for (TimePoint* time : {&turn.from, &turn.to}) *time += (*time - kStart) / 300;
  }
  const auto found = judgeParts(offsetsOfParts(turns, recording.imu, camera()), recording);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_THAT(found[0].text, HasSubstr("0.33 % too fast"));
  EXPECT_THAT(found[0].text, HasSubstr("since the first by about 0.996"));
}

TEST(ClockShift, ImagesInReverseOrderAreRecognised) {
  const auto samples = randomTurning(1);
  const TimePoint last = kStart + seconds(88);
  const auto turns = turnsOf(samples, Duration{0});
  std::vector<Turn> reversed;
  for (auto turn = turns.rbegin(); turn != turns.rend(); ++turn) {
    reversed.push_back(
        {last - (turn->to - kStart), last - (turn->from - kStart), -turn->of_images});
  }
  EXPECT_TRUE(areBackwards(reversed, samples, camera(), kStart, last));
  EXPECT_FALSE(areBackwards(turns, samples, camera(), kStart, last));
}

TEST(ClockShift, IsNamedWithItsCauseAndItsFix) {
  const auto textOf = [](double shift) { return shiftFinding(shift, camera()).front().text; };
  EXPECT_THAT(textOf(-37.0), HasSubstr("37 s ahead of that of the IMU by their turning, as TAI"));
  EXPECT_THAT(textOf(-18.0), HasSubstr("as GPS time is ahead of UTC by 18 s: subtract"));
  EXPECT_THAT(textOf(19.0), HasSubstr("19 s behind that of the IMU"));
  EXPECT_THAT(textOf(7200.1), HasSubstr("a time zone is of 2 h: add"));
  EXPECT_THAT(textOf(-3.25),
              HasSubstr("3.25 s ahead of that of the IMU by their turning: subtract"));
}

TEST(ClockShift, MovesAllImages) {
  replay::Recording recording;
  recording.frames.resize(2);
  recording.frames[1].time = TimePoint(seconds(41));
  shiftImages(-37.0, recording);
  EXPECT_EQ(recording.frames[1].time, TimePoint(seconds(4)));
}

}  // namespace
}  // namespace perdure::tools
