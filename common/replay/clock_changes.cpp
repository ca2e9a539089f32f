// Findings about changes of a clock in mid-drive.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/replay/clock_check.h"
#include "common/replay/files/stamps.h"
#include "common/replay/recording.h"

namespace perdure::replay {
namespace {

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
  return {judged ? Grade::kFatal : Grade::kCause, "clock_set_alone",
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
  finding.grade = isShort(pause) ? DataFinding::Grade::kCause : DataFinding::Grade::kFatal;
  finding.code = "clock_set_alone";
  finding.text = fmt::format(
      "{}: the stamps of {} jump ahead by {}, and end later by this time than "
      "those of the other sensor: its clock was set; subtract the time from there "
      "on, or cut the drive",
      pause.place, nameOfSensor(pause.sensor), secondsText(stepOf(pause) - pause.usual));
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

}  // namespace perdure::replay
