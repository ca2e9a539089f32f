#include "common/replay/clock_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "common/replay/recording.h"

namespace perdure::replay {
namespace {

using std::chrono::milliseconds, std::chrono::seconds;
using testing::HasSubstr;
using Stamp = std::function<Duration(Duration)>;

constexpr Duration kSame(Duration time) { return time; }

/// Reads a drive of 20 s whose sensors write the given stamps, and settles the clocks.
Recording readWith(const Stamp& imu, const Stamp& images) {
  Recording recording;
  for (int i = 0; i < 2000; ++i) {
    ImuSample sample;
    sample.time = TimePoint(imu(seconds(100) + i * milliseconds(10)));
    sample.gyro.x() = i;
    recording.imu.push_back(sample);
  }
  recording.frames.resize(200);
  for (int i = 0; i < 200; ++i) {
    recording.frames[static_cast<std::size_t>(i)].time =
        TimePoint(images(seconds(100) + i * milliseconds(100)));
  }
  orderImu(recording, "imu.csv");
  orderByTime(recording.frames, "frame", "images.csv", recording);
  settleClocks(recording);
  return recording;
}

std::string finding(const Recording& recording, DataFinding::Grade grade, const char* code) {
  for (const auto& one : checkClocks(recording, {})) {
    if (one.code == code && one.grade == grade) return one.text;
  }
  return "none";
}

Stamp setBy(Duration by) {
  return [by](Duration time) { return time + (time >= seconds(110) ? by : Duration{0}); };
}

TEST(ClockCheck, AClockThatWasSetForAllSensorsIsReadOnAndSaid) {
  const auto drive = readWith(setBy(-milliseconds(2003)), setBy(-milliseconds(2003)));
  EXPECT_THAT(finding(drive, DataFinding::Grade::kWarning, "clock_set"),
              HasSubstr("imu.csv, message 1001, images.csv, message 101: the clock was set back by "
                        "2.003 s during the drive"));
  ASSERT_EQ(drive.frames.size(), 200U);
  EXPECT_EQ(drive.frames.back().time - drive.imu.back().time, -milliseconds(90));
}

TEST(ClockCheck, ASmallStepBackOfAllSensorsIsSeenInTheIntervalsOfTheImages) {
  for (const int ms : {62, 80, 100, 120, 149, 150, 180, 200, 250, 299, 300, 350}) {
    const auto drive = readWith(setBy(-milliseconds(ms)), setBy(-milliseconds(ms)));
    EXPECT_THAT(finding(drive, DataFinding::Grade::kWarning, "clock_set"), HasSubstr("set back"));
    EXPECT_EQ(finding(drive, DataFinding::Grade::kFatal, "clock_set_alone"), "none") << ms;
    ASSERT_EQ(drive.frames.size(), 200U);
    for (std::size_t i = 1; i < 200; ++i) {
      EXPECT_EQ(drive.frames[i].time - drive.frames[i - 1].time, milliseconds(100)) << ms;
    }
    EXPECT_THAT(finding(readWith(setBy(-milliseconds(ms)), kSame), DataFinding::Grade::kFatal,
                        "clock_set_alone"),
                HasSubstr("of the IMU go back"));
  }
}

TEST(ClockCheck, AClockThatWasSetForOneSensorIsRefusedWithItsPlace) {
  EXPECT_THAT(finding(readWith(kSame, setBy(-milliseconds(2003))), DataFinding::Grade::kFatal,
                      "clock_set_alone"),
              HasSubstr("images.csv, message 101: the stamps of the images go back by 1.903 s"));
  EXPECT_THAT(
      finding(readWith(kSame, setBy(seconds(5))), DataFinding::Grade::kFatal, "clock_set_alone"),
      HasSubstr("message 101: the stamps of the images jump ahead by 5 s"));
  const auto restarted = [](Duration time) { return time % seconds(110); };
  EXPECT_THAT(
      finding(readWith(restarted, restarted), DataFinding::Grade::kFatal, "clock_set_alone"),
      HasSubstr("the device was restarted"));
}

TEST(ClockCheck, APauseOfBothSensorsIsNoFault) {
  const auto drive = readWith(setBy(seconds(60)), setBy(seconds(60)));
  EXPECT_THAT(finding(drive, DataFinding::Grade::kWarning, "clock_paused"),
              HasSubstr("message 1001: no data of the IMU for 60.01 s"));
}

TEST(ClockCheck, AShortJumpAheadOfOneClockIsSaidAndLostImagesAreNot) {
  for (const int ms : {400, 700, 950}) {
    EXPECT_THAT(finding(readWith(kSame, setBy(milliseconds(ms))), DataFinding::Grade::kCause,
                        "clock_set_alone"),
                HasSubstr("images.csv, message 101: the stamps of the images jump ahead by"))
        << ms;
    const auto pause = finding(readWith(setBy(milliseconds(ms)), setBy(milliseconds(ms))),
                               DataFinding::Grade::kWarning, "clock_paused");
    EXPECT_THAT(pause, HasSubstr("no data of the IMU"));
    EXPECT_EQ(pause.ends_with("; vio starts again after it"), ms > 800) << pause;
    const auto lost = [&](Duration time) {  // repeated stamps are left out
      const bool inside = time >= seconds(110) && time < seconds(110) + milliseconds(ms);
      return inside ? seconds(110) - milliseconds(100) : time;
    };
    const auto drive = readWith(kSame, lost);
    EXPECT_EQ(finding(drive, DataFinding::Grade::kCause, "clock_set_alone"), "none");
    EXPECT_EQ(finding(drive, DataFinding::Grade::kWarning, "clock_paused"), "none");
  }
}

TEST(ClockCheck, AClockOfAnotherRateIsSaidByTheDeclaredRatesOfBothSensors) {
  const auto warningOf = [](double imu_hz, double images_hz) {
    auto drive = readWith(kSame, kSame);  // 100 and 10 Hz
    drive.calibration.imu.emplace().rate_hz = imu_hz;
    drive.calibration.cameras.emplace_back().rate_hz = images_hz;
    return finding(drive, DataFinding::Grade::kWarning, "declared_rates");
  };
  EXPECT_THAT(warningOf(105.0, 10.5), HasSubstr("both 4.8 % lower than rate_hz (10.5 and "
                                                "105): their clock runs too fast"));
  EXPECT_THAT(warningOf(95.0, 9.5), HasSubstr("5.3 % higher"));
  EXPECT_EQ(warningOf(105.0, 10.0), "none");
  EXPECT_EQ(warningOf(101.0, 10.1), "none");
}

TEST(ClockCheck, AClockOfOneSensorThatRunsFastIsToldFromACameraOfALowerRate) {
  const auto driveWith = [](int thousandths) {
    auto drive = readWith(
        kSame, [&](Duration time) { return time + (time - seconds(100)) * thousandths / 1000; });
    drive.calibration.imu.emplace().rate_hz = 100.0;
    auto& camera = drive.calibration.cameras.emplace_back();
    camera.name = "cam0", camera.rate_hz = 10.0;
    return drive;
  };
  EXPECT_THAT(finding(driveWith(24), DataFinding::Grade::kWarning, "declared_rates"),
              HasSubstr("the stamps of cam0 run 2.4 % too fast"));
  auto drive = driveWith(70);
  EXPECT_THAT(finding(drive, DataFinding::Grade::kWarning, "declared_rates"),
              HasSubstr("the stamps of cam0 run 7.0 % too fast"));
  const TimePoint end = drive.imu.back().time;
  std::erase_if(drive.frames, [&](const auto& frame) { return frame.time > end; });
  EXPECT_EQ(finding(drive, DataFinding::Grade::kWarning, "declared_rates"), "none");
}

TEST(ClockCheck, ATwentiethOfTheImagesOutsideOfTheSamplesIsTold) {
  const auto warningOf = [](Duration late) {
    const Stamp images = [=](Duration time) { return time + late; };
    return finding(readWith(kSame, images), DataFinding::Grade::kWarning, "imu_covers_part");
  };
  EXPECT_EQ(warningOf(milliseconds(700)), "none");
  EXPECT_THAT(warningOf(milliseconds(1500)), HasSubstr("only 185 of 200 images"));
}

TEST(ClockCheck, ACounterThatOneSensorDoesNotHaveIsContinuedInBoth) {
  const Duration length = Duration(4'294'967'296'000);
  const auto round = [&](Duration time) { return (length - seconds(110) + time) % length; };
  const auto whole = [&](Duration time) { return length - seconds(110) + time; };
  for (const auto& drive : {readWith(round, round), readWith(round, whole)}) {
    EXPECT_THAT(finding(drive, DataFinding::Grade::kWarning, "clock_wrapped"),
                HasSubstr("imu.csv, message 1001: the stamps of the IMU go back by 4294.957296 s: "
                          "a counter of 32 bits of µs wrapped"));
    EXPECT_EQ(drive.frames.back().time - drive.imu.back().time, -milliseconds(90));
  }
  const auto behind = [&](Duration time) { return time - seconds(90); };  // after the wrap only
  const auto drive = readWith(round, behind);
  EXPECT_EQ(drive.frames.front().time - drive.imu.front().time, seconds(20));
}

TEST(ClockCheck, StampsOfArrivalAreSaidAndAChangedFrameRateIsNone) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> latency(0.0, 0.045);
  const auto late = [&](Duration time) { return time + durationFromSeconds(latency(random)); };
  EXPECT_THAT(finding(readWith(kSame, late), DataFinding::Grade::kCause, "stamps_of_arrival"),
              HasSubstr("a latency that varies by 15 ms"));
  const auto slower = [](Duration time) {
    return time + (time > seconds(105) ? (time - seconds(105)) / 2 : Duration{0});
  };
  const auto lossy = [](Duration time) { return time + time / seconds(2) * milliseconds(100); };
  for (const Stamp& images : {Stamp(kSame), Stamp(slower), Stamp(lossy)}) {
    EXPECT_EQ(finding(readWith(kSame, images), DataFinding::Grade::kCause, "stamps_of_arrival"),
              "none");
  }
}

TEST(ClockCheck, SamplesOfAFifoAreSaidWithTheirInterval) {
  const auto packets = [](Duration time) {
    return time / milliseconds(100) * milliseconds(100) + time % milliseconds(100) / 500;
  };
  EXPECT_THAT(
      finding(readWith(packets, kSame), DataFinding::Grade::kCause, "imu_bursts"),
      HasSubstr("packets of 10 samples (a FIFO); stamp them at constant intervals of 10 ms"));
}

TEST(ClockCheck, DifferencesOfClocksHaveTheirCauses) {
  EXPECT_EQ(causeOfShift(37.01), ", as TAI is ahead of UTC by 37 s");
  EXPECT_EQ(causeOfShift(-18.0), ", as GPS time is ahead of UTC by 18 s");
  EXPECT_EQ(causeOfShift(7200.0), ", as a time zone is of 2 h");
  EXPECT_EQ(causeOfShift(3.0), "");
}

}  // namespace
}  // namespace perdure::replay
