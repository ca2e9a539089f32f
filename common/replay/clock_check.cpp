#include "common/replay/clock_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "common/base/algorithms/median.h"
#include "common/replay/files/stamps.h"
#include "common/replay/recording.h"
#include "common/replay/stamp_rhythm.h"

namespace perdure::replay {
namespace {

using StampGrade = DataFinding::Grade;
using StampList = std::vector<TimePoint>;

/// Returns the median interval between stamps, without zero intervals, in ns. Returns nothing if
/// fewer than five intervals remain.
std::optional<double> intervalOf(StampList stamps) {
  std::sort(stamps.begin(), stamps.end());
  std::vector<std::int64_t> intervals;
  for (std::size_t i = 1; i < stamps.size(); ++i) {
    const Duration interval = between(stamps[i], stamps[i - 1]);
    if (interval > Duration{0}) intervals.push_back(interval.count());
  }
  constexpr std::size_t kFewIntervals = 5;
  if (intervals.size() < kFewIntervals) return std::nullopt;
  return static_cast<double>(medianOf(std::move(intervals)));
}

StampList stampsOfImu(const Recording& recording) {
  StampList stamps;
  for (const ImuSample& sample : recording.imu) stamps.push_back(sample.time);
  return stamps;
}
StampList stampsOfCamera(const Recording& recording) {
  StampList stamps;
  for (const auto& frame : recording.frames) {
    if (frame.camera == 0) stamps.push_back(frame.time);
  }
  return stamps;
}

/// Adds stamps_equal if more than half of the stamps equal earlier ones and were left out
/// (`repeated`). They are fatal if fewer than a tenth remain (`kept`).
void checkEqual(const char* of, std::uint64_t repeated, std::size_t kept, DataFindings& findings) {
  const auto all = repeated + kept;
  const bool unusable = 10 * kept < all;
  // A list that contains each line twice has lost no data.
  if (2 * repeated <= all || repeated < 3) return;
  findings.push_back(
      {unusable ? StampGrade::kFatal : StampGrade::kWarning, "stamps_equal",
       fmt::format("{} of {} stamps of the {} are equal to others: they lost digits (written as "
                   "float, or in whole seconds?){}; write them as integers of nanoseconds or with "
                   "9 decimals",
                   repeated, all, of, unusable ? "" : ", or are those of packets")});
}

/// Adds stamps_count if the stamps are consecutive numbers (0, 1, 2 …) instead of times.
void checkCount(const char* of, const StampList& stamps, DataFindings& findings) {
  constexpr std::int64_t kHighest = 100'000'000;
  if (stamps.empty() || toNanoseconds(stamps.back()) > kHighest) return;
  const auto interval = intervalOf(stamps);
  const auto first = toNanoseconds(stamps.front());
  if (!interval || *interval != 1.0 || first > 10'000'000) return;
  findings.push_back(
      {StampGrade::kFatal, "stamps_count",
       fmt::format(
           "the stamps of the {} ({} … {}) are counts instead of times: write the time of each, "
           "in nanoseconds, on the clock of the other sensors",
           of, first, toNanoseconds(stamps.back()))});
}

/// A range of stamps as text in nanoseconds, by which users recognise a wrong unit.
std::string rangeText(TimePoint first, TimePoint last) {
  return fmt::format("{} … {} ns", toNanoseconds(first), toNanoseconds(last));
}

/// Suggests why the first stamps of images and IMU differ: another unit or another clock.
std::string guessOfClock(TimePoint images, TimePoint imu) {
  const double ratio = static_cast<double>(toNanoseconds(images)) /
                       std::max(1.0, static_cast<double>(toNanoseconds(imu)));
  constexpr std::array<std::pair<double, const char*>, 3> kUnits{
      {{1e3, "microseconds"}, {1e6, "milliseconds"}, {1e9, "seconds"}}};
  for (const auto& [factor, unit] : kUnits) {
    if (std::abs(ratio / factor - 1.0) < 0.05) {
      return fmt::format("the IMU's stamps look like {}: multiply them by {:.0f}", unit, factor);
    }
    if (std::abs(ratio * factor - 1.0) < 0.05) {
      return fmt::format("the images' stamps look like {}: multiply them by {:.0f}", unit, factor);
    }
  }
  const double apart = std::abs(toSeconds(images) - toSeconds(imu));
  return fmt::format(
      "they are {:.9g} s apart{}: they come from two clocks; add the difference of the clocks to "
      "one "
      "of them",
      apart, causeOfShift(apart));
}

/// Checks whether the stamps of camera and IMU can come from one clock.
void checkShared(const Recording& recording, DataFindings& findings) {
  if (recording.imu.empty() || recording.frames.empty()) return;
  const TimePoint first = recording.frames.front().time, last = recording.frames.back().time;
  const TimePoint from = recording.imu.front().time, to = recording.imu.back().time;
  if (from > last || to < first) {
    findings.push_back(
        {StampGrade::kFatal, "clocks_apart",
         fmt::format("camera and IMU stamps do not overlap: images {}, inertial "
                     "samples {}; {}",
                     rangeText(first, last), rangeText(from, to), guessOfClock(first, from))});
    return;
  }
  const auto covered =
      std::count_if(recording.frames.begin(), recording.frames.end(),
                    [&](const auto& frame) { return frame.time >= from && frame.time <= to; });
  const auto all = static_cast<std::ptrdiff_t>(recording.frames.size());
  // In a short drive, a small offset of the stamps excludes many images at the ends.
  constexpr Duration kOffset = std::chrono::milliseconds(500);
  const bool short_time = std::max(between(from, first), between(last, to)) < kOffset;
  if ((short_time ? 10 : 20) * (all - covered) <= all) return;
  findings.push_back(
      {StampGrade::kWarning, "imu_covers_part",
       fmt::format("only {} of {} images lie within the time of the inertial samples: "
                   "images {}, samples {}: samples are missing, or the clocks run at different "
                   "rates",
                   covered, all, rangeText(first, last), rangeText(from, to))});
}

void checkRate(const Recording& recording, DataFindings& findings) {
  const auto& imu = recording.imu;
  if (!recording.calibration.imu || imu.size() < 10) return;
  std::vector<double> intervals;
  for (std::size_t i = 1; i < imu.size(); ++i)
    intervals.push_back(toSeconds(imu[i].time - imu[i - 1].time));
  const double rate = 1.0 / std::max(1e-9, medianOf(intervals));
  const double said = recording.calibration.imu->rate_hz;
  if (said <= 0.0 || (rate < 1.5 * said && rate > said / 1.5)) return;
  findings.push_back(
      {StampGrade::kWarning, "imu_rate",
       fmt::format("the rate of the inertial samples is {:.4g} Hz, that of the calibration {:.4g}: "
                   "check the unit of their stamps, or set rate_hz",
                   rate, said)});
}

/// Adds declared_rates if one of the clocks runs at another rate: relative to the IMU and to the
/// declared rates, the image intervals are too long by the share `apart`, and the images end later
/// by the same share. If only the camera's declared rate is wrong, both sensors end together.
void checkOneRate(const Recording& recording, const StampList& imu, const StampList& images,
                  double apart, DataFindings& findings) {
  constexpr double kLeast = 0.02, kStarts_s = 0.1, kAlike = 0.2, kShows_s = 0.25;
  const double awaited = apart * toSeconds(between(imu.back(), imu.front())),
               ends = toSeconds(between(images.back(), imu.back()));
  if (std::abs(apart) < kLeast || !std::isfinite(awaited) || std::abs(awaited) < kShows_s ||
      std::abs(ends - awaited) > kAlike * std::abs(awaited) ||
      std::abs(toSeconds(between(images.front(), imu.front()))) > kStarts_s)
    return;
  findings.push_back(
      {StampGrade::kWarning, "declared_rates",
       fmt::format("the stamps of {} run {:.1f} % too {} for those of the IMU: by rate_hz, and "
                   "because they end {:.2f} s {}; see which of them has a wrong clock",
                   recording.calibration.cameras.front().name, 100.0 * std::abs(apart),
                   apart > 0.0 ? "fast" : "slow", std::abs(ends),
                   ends > 0.0 ? "later" : "earlier")});
}

/// Adds declared_rates if the intervals of both sensors differ from the declared ones by the same
/// factor, because their common clock may be wrong.
void checkCommonRate(const Recording& recording, const StampList& imu, const StampList& images,
                     DataFindings& findings) {
  constexpr double kLeast = 0.02, kAlike = 0.003;
  const auto of_imu = intervalOf(imu), of_images = intervalOf(images);
  if (!of_imu || !of_images || !recording.calibration.imu) return;
  const double imu_hz = recording.calibration.imu->rate_hz,
               images_hz = recording.calibration.cameras.front().rate_hz;
  const double slower = *of_imu * 1e-9 * imu_hz, of_camera = *of_images * 1e-9 * images_hz;
  checkOneRate(recording, imu, images, of_camera / slower - 1.0, findings);
  if (std::abs(slower - 1.0) < kLeast || std::abs(of_camera / slower - 1.0) > kAlike) return;
  findings.push_back(
      {StampGrade::kWarning, "declared_rates",
       fmt::format(
           "the rates of images and inertial samples, {:.4g} and {:.4g} Hz, are both {:.1f} % {} "
           "than rate_hz ({:.4g} and {:.4g}): their clock runs too {}, which changes "
           "all distances, or both rate_hz are wrong",
           1e9 / *of_images, 1e9 / *of_imu, 100.0 * std::abs(1.0 / slower - 1.0),
           slower > 1.0 ? "lower" : "higher", images_hz, imu_hz, slower > 1.0 ? "fast" : "slow")});
}

using Kind = ClockChange::Kind;

const char* nameOfSensor(const std::string& sensor) {
  if (sensor == "imu") return "the IMU";
  if (sensor == "frame") return "the images";
  if (sensor == "accel") return "the accelerometer";
  return sensor == "stereo" ? "cam1" : sensor == "speed" ? "the speed" : "the ground truth";
}

/// Returns a sensor's clock changes of one kind, in order.
std::vector<ClockChange*> changesOf(Recording& recording, const std::string& sensor, Kind kind) {
  std::vector<ClockChange*> some;
  for (ClockChange& change : recording.clock_changes) {
    if (change.sensor == sensor && change.kind == kind) some.push_back(&change);
  }
  return some;
}

/// Adds `by` to all times of a sensor that are not before `from`.
void shift(Recording& recording, const std::string& sensor, TimePoint from, Duration by) {
  const auto move = [&](auto& items) {
    for (auto& item : items) item.time += item.time >= from ? by : Duration{0};
  };
  if (sensor == "imu") move(recording.imu);
  if (sensor == "speed") move(recording.speed);
  if (sensor == "frame") move(recording.frames), sortFrames(recording);
}

/// Returns whether the stamps begin again near 0 because the device was restarted. The length of
/// the pause is then not known.
bool isRestart(const ClockChange& change) {
  constexpr Duration kStart = std::chrono::seconds(5);
  return change.after < change.before && change.after >= TimePoint{} &&
         change.after < TimePoint{} + kStart;
}

/// Returns whether the clocks of a sensor and of the IMU were set by the same amount. An amount is
/// known to one interval, or less precisely if samples are missing.
bool isAlike(const ClockChange& change, const ClockChange& imu) {
  const Duration more = between(TimePoint(imu.added), TimePoint(change.added));
  return !isRestart(imu) && multipleOf(5, more) > multipleOf(-4, change.usual) &&
         more < multipleOf(20, change.usual);
}

void settleSet(Recording& recording) {
  const auto of_imu = changesOf(recording, "imu", Kind::kSet);
  for (const std::string sensor : {"frame", "stereo", "speed", "truth", "accel"}) {
    const auto of_sensor = changesOf(recording, sensor, Kind::kSet);
    if (!std::equal(of_sensor.begin(), of_sensor.end(), of_imu.begin(), of_imu.end(),
                    [](const auto* one, const auto* imu) { return isAlike(*one, *imu); })) {
      continue;
    }
    Duration more{0};
    for (std::size_t i = 0; i < of_imu.size(); ++i) {
      const Duration by = of_imu[i]->added - of_sensor[i]->added;
      shift(recording, sensor, of_sensor[i]->continues + more, by);
      more += by;
      of_sensor[i]->common = true;
      if (sensor == "frame") of_imu[i]->common = true;
    }
  }
}

/// Adds whole lengths of the counter to the stamps of a sensor that started after the other
/// sensor's counter had wrapped.
void settleCounters(Recording& recording) {
  if (recording.imu.empty() || recording.frames.empty()) return;
  const TimePoint imu = recording.imu.front().time, images = recording.frames.front().time;
  if (images <= recording.imu.back().time && imu <= recording.frames.back().time) return;
  for (const ClockChange& change : recording.clock_changes) {
    if (change.kind != Kind::kCounter) continue;
    const Duration behind = between(imu, images);
    const auto rounds = (std::chrono::abs(behind) + change.added / 2) / change.added;
    return shift(recording, behind > Duration{0} ? "frame" : "imu", TimePoint::min(),
                 multipleOf(rounds, change.added));
  }
}

std::string secondsText(Duration amount) {
  return fmt::format("{:.10g} s", std::abs(toSeconds(amount)));
}

Duration stepOf(const ClockChange& change) { return between(change.after, change.before); }

/// Returns whether the IMU and another sensor have this pause in common.
bool isOfBoth(const ClockChange& pause, const std::vector<ClockChange>& all) {
  constexpr Duration kAlike = std::chrono::milliseconds(100);
  return std::any_of(all.begin(), all.end(), [&](const ClockChange& other) {
    return other.kind == Kind::kPause && (other.sensor == "imu") != (pause.sensor == "imu") &&
           std::chrono::abs(between(other.before, pause.before)) < kAlike &&
           std::chrono::abs(stepOf(other) - stepOf(pause)) < kAlike;
  });
}

/// Returns whether vio, in its default configuration, starts again after this pause.
bool endsVio(const ClockChange& pause, const std::vector<ClockChange>& all) {
  constexpr Duration kBlackout = std::chrono::milliseconds(800), kImuGap = std::chrono::seconds(2);
  return (pause.sensor == "imu" && stepOf(pause) > kImuGap) ||
         (isOfBoth(pause, all) && stepOf(pause) > kBlackout);
}

/// Explains a step of one sensor, and gives the fix.
std::string causeOfStep(const ClockChange& step) {
  if (!isRestart(step)) {
    return ", those of the other sensors show no such step (their rate is too low, or they have "
           "another clock): cut the drive there into two";
  }
  if (step.after >= TimePoint{} + step.usual) {
    return ", to their start: the device was restarted; cut the drive there into two";
  }
  return fmt::format(
      ", to their start: a counter of {} wrapped (then add these to all stamps from there on), or "
      "the device was restarted (then cut the drive there into two)",
      secondsText(step.added));
}

/// The finding for `count` changes of a kind. Its text gives the place and the amount of the first.
DataFinding findingOf(const ClockChange& first, std::size_t count, const std::string& places,
                      bool ends_vio) {
  using Grade = DataFinding::Grade;
  const std::string sensor = nameOfSensor(first.sensor);
  const bool back = first.after < first.before;
  const std::string more = count > 1 ? fmt::format(" ({} times in all)", count) : "",
                    step = secondsText(between(first.after, first.before)) + more;
  if (first.kind == Kind::kCounter) {
    return {Grade::kWarning, "clock_wrapped",
            fmt::format("{}: the stamps of {} go back by {}: a counter of {} wrapped; the "
                        "stamps continue from there",
                        places, sensor, step, first.counter)};
  }
  if (first.kind == Kind::kDigits) {
    return {Grade::kFatal, "stamps_are_digits",
            fmt::format("{}: the stamps of {} {} by {} at a full minute: they are the digits of a "
                        "time of day (HHMMSS); convert them to a time that increases evenly, "
                        "3600 HH + 60 MM + SS; if the recording did pause for just that time, cut "
                        "the drive there",
                        places, sensor, back ? "go back" : "jump ahead", step)};
  }
  if (first.kind == Kind::kJoined) {
    return {Grade::kFatal, "stamps_are_digits",
            fmt::format("{}: in the stamps of {}, seconds and nanoseconds were joined without the "
                        "leading zeros of the nanoseconds; write them with \"%d%09d\"",
                        places, sensor)};
  }
  if (first.kind == Kind::kPause) {
    return {Grade::kWarning, "clock_paused",
            fmt::format("{}: no data of {} for {}: the recording paused, or its clock was set "
                        "ahead{}",
                        places, sensor, step, ends_vio ? "; vio starts again after it" : "")};
  }
  if (first.common) {
    return {Grade::kWarning, "clock_set",
            fmt::format("{}: the clock was set {} by {} during the drive, for all sensors; the "
                        "drive is read without that step",
                        places, back ? "back" : "ahead", secondsText(first.added) + more)};
  }
  const bool judged = first.sensor == "imu" || first.sensor == "frame";
  return {judged ? Grade::kFatal : Grade::kWarning, "clock_set_alone",
          fmt::format("{}: the stamps of {} {} by {}{}", places, sensor,
                      back ? "go back" : "jump ahead", step, causeOfStep(first))};
}

bool isShort(const ClockChange& pause) {
  return stepOf(pause) <= std::max<Duration>(std::chrono::seconds(1), multipleOf(20, pause.usual));
}

/// Returns whether the pause is a clock that was set ahead, because the sensor then ends later than
/// the other one by the length of the pause.
bool isSetAhead(const Recording& recording, const ClockChange& pause) {
  if (recording.imu.empty() || recording.frames.empty()) return false;
  const auto ofBoth = [](const auto& a, const auto& b) {
    return std::pair(between(a.front().time, b.front().time),
                     between(a.back().time, b.back().time));
  };
  const auto [starts, ends] = pause.sensor == "imu" ? ofBoth(recording.imu, recording.frames)
                                                    : ofBoth(recording.frames, recording.imu);
  const Duration half = stepOf(pause) / 2;
  if (std::chrono::abs(starts) > half || ends < half) return false;
  return !isShort(pause) ||
         std::chrono::abs(ends - starts - (stepOf(pause) - pause.usual)) < half / 2;
}

/// Removes short pauses, which are due to lost samples. Keeps those of a clock that was set ahead,
/// and those that both sensors have.
void dropShortPauses(Recording& recording) {
  const std::vector<ClockChange> all = recording.clock_changes;
  std::erase_if(recording.clock_changes, [&](const ClockChange& pause) {
    return pause.kind == Kind::kPause && isShort(pause) && !isSetAhead(recording, pause) &&
           !isOfBoth(pause, all);
  });
}

void addSetAhead(const Recording& recording, const ClockChange& pause, DataFinding& finding) {
  if (!isSetAhead(recording, pause)) return;
  finding.grade = isShort(pause) ? DataFinding::Grade::kWarning : DataFinding::Grade::kFatal;
  finding.code = "clock_set_alone";
  finding.text = fmt::format(
      "{}: the stamps of {} jump ahead by {}, and end later by this time than "
      "those of the other sensor: its clock was set; subtract the time from there "
      "on, or cut the drive",
      pause.place, nameOfSensor(pause.sensor), secondsText(stepOf(pause)));
}

}  // namespace

void settleClocks(Recording& recording) {
  settleSet(recording);
  settleCounters(recording);
  dropShortPauses(recording);
}

void checkClockChanges(const Recording& recording, const DataUse& use, DataFindings& findings) {
  const auto& all = recording.clock_changes;
  for (auto first = all.begin(); first != all.end(); ++first) {
    const bool judged = first->sensor == "imu" || first->sensor == "frame";
    if ((first->sensor == "imu" && !use.imu) || (first->kind == Kind::kPause && !judged)) continue;
    const auto isSame = [&](const ClockChange& other) {
      return other.kind == first->kind && other.sensor == first->sensor &&
             other.common == first->common;
    };
    if (std::any_of(all.begin(), first, isSame)) continue;
    // If all sensors share the clock, one sentence reports the change.
    const auto isAlso = [&](const ClockChange& other) {
      return other.common && first->common && other.kind == first->kind;
    };
    if (std::any_of(all.begin(), first, isAlso)) continue;
    std::string places;
    for (const auto& other : all) {
      if (!isAlso(other) && &other != &*first) continue;
      if (places.find(other.place.substr(0, other.place.rfind(':'))) != places.npos) continue;
      places += (places.empty() ? "" : ", ") + other.place;
    }
    const auto count = std::count_if(first, all.end(), isSame);
    const bool ends_vio = std::any_of(first, all.end(), [&](const ClockChange& other) {
      return isSame(other) && endsVio(other, all);
    });
    findings.push_back(findingOf(*first, static_cast<std::size_t>(count), places, ends_vio));
    if (first->kind == Kind::kPause) addSetAhead(recording, *first, findings.back());
  }
}

std::int64_t factorOfStamps(StampList imu, StampList images) {
  const auto of_imu = intervalOf(std::move(imu)), of_images = intervalOf(std::move(images));
  if (!of_imu || !of_images) return 1;
  for (const std::int64_t factor : {1, 1'000, 1'000'000}) {
    const double scale = 1e-9 * static_cast<double>(factor);
    const double imu_hz = 1.0 / (*of_imu * scale), images_hz = 1.0 / (*of_images * scale);
    if (imu_hz >= 20.0 && imu_hz <= 4000.0 && images_hz >= 1.0 && images_hz <= 200.0) return factor;
  }
  return 1;
}

std::string causeOfShift(double seconds) {
  struct Cause {
    double seconds;
    const char* text;
  };
  constexpr std::array kCauses{
      Cause{18.0, "GPS time is ahead of UTC by 18 s"},
      Cause{19.0, "TAI is ahead of GPS time by 19 s"},
      Cause{37.0, "TAI is ahead of UTC by 37 s"},
      Cause{315'964'782.0, "GPS time counts from 1980, UTC from 1970"},
      Cause{315'964'800.0, "GPS time counts from 1980, UTC from 1970"},
      Cause{2'208'988'800.0, "NTP's time counts from 1900, UTC from 1970"}};
  constexpr double kNear_s = 0.2, kHour_s = 3600.0;
  seconds = std::abs(seconds);
  for (const Cause& cause : kCauses) {
    if (std::abs(seconds - cause.seconds) < kNear_s) return std::string(", as ") + cause.text;
  }
  const double hours = std::round(seconds / kHour_s);
  if (hours < 1.0 || hours > 14.0 || std::abs(seconds - kHour_s * hours) > kNear_s) return {};
  return fmt::format(", as a time zone is of {:.0f} h", hours);
}

DataFindings checkClocks(const Recording& recording, const DataUse& use) {
  DataFindings findings;
  checkClockChanges(recording, use, findings);
  const auto isDigits = [](const auto& one) { return one.code == "stamps_are_digits"; };
  if (std::ranges::any_of(findings, isDigits)) return findings;  // rates and units would be wrong
  const bool of_imu = use.imu && !recording.imu.empty();
  const StampList imu = of_imu ? stampsOfImu(recording) : StampList(),
                  images = stampsOfCamera(recording);
  if (of_imu) checkEqual("IMU", recording.reasons.of("imu_not_increasing"), imu.size(), findings);
  checkEqual("images", recording.reasons.of("frame_not_increasing"), images.size(), findings);
  // Without an IMU, frame numbers may replace times, as in KITTI tracking.
  if (!of_imu || images.empty()) return findings;
  const auto factor = factorOfStamps(imu, images);
  if (factor == 1) {  // excludes 1 kHz samples in whole ms, which increase by 1 as counts do
    checkCount("images", images, findings);
    checkCount("samples of the IMU", imu, findings);
  } else if (const auto why = whyDateDigits(std::to_string(toNanoseconds(images.front())));
             !why.empty()) {
    findings.push_back({StampGrade::kFatal, "stamps_are_digits", "the first stamp, " + why});
  } else {
    findings.push_back(
        {StampGrade::kFatal, "stamps_unit",
         fmt::format(
             "the stamps are in {}, not nanoseconds (otherwise the interval of the images would be "
             "{:.0f} ns and that of the inertial samples {:.0f} ns): multiply them by {}, or let "
             "perdure doctor --data DRIVE --fix COPY do it",
             factor == 1000 ? "µs" : "ms", *intervalOf(images), *intervalOf(imu), factor)});
  }
  if (std::any_of(findings.begin(), findings.end(),
                  [](const auto& one) { return one.grade == StampGrade::kFatal; })) {
    return findings;
  }
  checkShared(recording, findings);
  checkArrival(images, findings);
  if (checkBursts(imu, findings)) return findings;  // rates would be wrong
  checkRate(recording, findings);
  checkCommonRate(recording, imu, images, findings);
  return findings;
}

}  // namespace perdure::replay
