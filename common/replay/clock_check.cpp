#include "common/replay/clock_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "common/base/algorithms/median.h"
#include "common/replay/files/stamps.h"
#include "common/replay/recording.h"

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

std::vector<double> intervalsOf(const std::vector<TimePoint>& stamps) {
  std::vector<double> intervals;
  for (std::size_t i = 1; i < stamps.size(); ++i) {
    intervals.push_back(toSeconds(stamps[i] - stamps[i - 1]));
  }
  return intervals;
}

/// Standard deviation of the latency in s. The latency of one stamp lengthens an interval and
/// shortens the next one, so that their covariance is its negative variance.
double latencyIn(const std::vector<double>& intervals, double usual) {
  constexpr double kPause = 6.0;  // intervals
  double mean = 0.0, sum = 0.0, squares = 0.0, count = 0.0;
  std::vector<std::pair<double, double>> pairs;
  for (std::size_t i = 1; i < intervals.size(); ++i) {
    if (std::max(intervals[i - 1], intervals[i]) > (1.0 + kPause) * usual) continue;
    pairs.emplace_back(intervals[i - 1], intervals[i]);
    mean += intervals[i], count += 1.0;
  }
  mean /= std::max(1.0, count);
  for (const auto& [a, b] : pairs) {
    const double product = (a - mean) * (b - mean);
    sum -= product, squares += product * product;
  }
  // Independent intervals have no covariance, except by chance.
  constexpr double kSurely = 4.0;
  return sum < kSurely * std::sqrt(squares) ? 0.0 : std::sqrt(sum / count);
}

/// Adds stamps_of_arrival if a long interval of the images is followed by a short one, as a latency
/// that varies by several milliseconds causes. Slow changes of the frame rate and lost images have
/// no effect.
void checkArrival(const std::vector<TimePoint>& images, DataFindings& findings) {
  constexpr std::size_t kFewestIntervals = 30;
  constexpr double kLeast_s = 0.004, kShare = 0.04, kLow = 0.95, kHigh = 1.05, kIrregular = 0.3;
  constexpr double kWhole = 0.1, kMostWhole = 0.9;  // regular images, some of which were dropped
  const auto intervals = intervalsOf(images);
  if (intervals.size() < kFewestIntervals) return;
  const double usual = medianOf(std::vector<double>(intervals));
  const double least_s = std::ranges::min(intervals);
  const auto whole = std::ranges::count_if(intervals, [&](double one) {
    return std::abs(one / least_s - std::round(one / least_s)) < kWhole;
  });
  const bool dropped =
      least_s > kShare * usual &&
      static_cast<double>(whole) > kMostWhole * static_cast<double>(intervals.size());
  if (dropped) return;
  const double latency = latencyIn(intervals, usual);
  const auto irregular = std::ranges::count_if(
      intervals, [&](double one) { return one < kLow * usual || one > kHigh * usual; });
  if (latency < std::max(kLeast_s, kShare * usual) ||
      static_cast<double>(irregular) < kIrregular * static_cast<double>(intervals.size()))
    return;
  const auto [least, most] = std::ranges::minmax(intervals);
  findings.push_back(
      {DataFinding::Grade::kCause, "stamps_of_arrival",
       fmt::format("the intervals of the images vary from {:.0f} to {:.0f} ms, and a short one "
                   "follows a long one: the stamps are those of arrival, with a latency that "
                   "varies by {:.0f} ms (standard deviation); record the stamps of the sensor or "
                   "of its driver",
                   1e3 * least, 1e3 * most, 1e3 * latency)});
}

/// Adds imu_bursts if most samples follow another almost at once, because they were read in packets
/// from a FIFO. Returns whether it did.
bool checkBursts(const std::vector<TimePoint>& imu, DataFindings& findings) {
  constexpr std::size_t kFewestIntervals = 40;
  constexpr double kAtOnce = 0.2, kMostOf = 0.6;
  const auto intervals = intervalsOf(imu);
  if (intervals.size() < kFewestIntervals) return false;
  const auto all = static_cast<double>(intervals.size());
  const double at_once_s = kAtOnce * toSeconds(imu.back() - imu.front()) / all;
  std::vector<std::size_t> firsts;  // of the packets
  for (std::size_t i = 0; i < intervals.size(); ++i) {
    if (intervals[i] >= at_once_s) firsts.push_back(i + 1);
  }
  if (firsts.size() < 2 || static_cast<double>(firsts.size()) > (1.0 - kMostOf) * all) return false;
  const auto samples = static_cast<double>(firsts.back() - firsts.front());
  const double packet = samples / static_cast<double>(firsts.size() - 1),
               usual_ms = 1e3 * toSeconds(imu[firsts.back()] - imu[firsts.front()]) / samples;
  constexpr double kMost = 100.0, kLongest_ms = 500.0;  // more are recorded at intervals
  if (packet > kMost || usual_ms * packet > kLongest_ms) return false;
  findings.push_back(
      {DataFinding::Grade::kCause, "imu_bursts",
       fmt::format("{:.0f} % of the inertial samples come {:.2g} ms after another, then none for "
                   "{:.3g} ms: their stamps are those of packets of {:.0f} samples (a FIFO); stamp "
                   "them at constant intervals of {:.4g} ms up to the last one of each packet",
                   100.0 - 100.0 / packet, 1e3 * medianOf(std::vector<double>(intervals)),
                   usual_ms * packet, packet, usual_ms)});
  return true;
}

}  // namespace

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
