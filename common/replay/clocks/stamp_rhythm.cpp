#include "common/replay/clocks/stamp_rhythm.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/base/algorithms/median.h"

namespace perdure::replay {
namespace {

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
  double sum = 0.0, count = 0.0;
  for (std::size_t i = 1; i < intervals.size(); ++i) {
    const double a = intervals[i - 1] - usual, b = intervals[i] - usual;
    if (std::max(a, b) > kPause * usual) continue;
    sum -= a * b, count += 1.0;
  }
  return std::sqrt(std::max(0.0, sum / std::max(1.0, count)));
}

}  // namespace

void checkArrival(const std::vector<TimePoint>& images, DataFindings& findings) {
  constexpr std::size_t kFewestIntervals = 30;
  constexpr double kLeast_s = 0.005, kShare = 0.08, kLow = 0.95, kHigh = 1.05, kIrregular = 0.3;
  const auto intervals = intervalsOf(images);
  if (intervals.size() < kFewestIntervals) return;
  const double usual = medianOf(std::vector<double>(intervals));
  const double latency = latencyIn(intervals, usual);
  const auto irregular = std::ranges::count_if(
      intervals, [&](double one) { return one < kLow * usual || one > kHigh * usual; });
  if (latency < std::max(kLeast_s, kShare * usual) ||
      static_cast<double>(irregular) < kIrregular * static_cast<double>(intervals.size()))
    return;
  const auto [least, most] = std::ranges::minmax(intervals);
  findings.push_back(
      {DataFinding::Grade::kWarning, "stamps_of_arrival",
       fmt::format("the intervals of the images vary from {:.0f} to {:.0f} ms, and a short one "
                   "follows a long one: the stamps are those of arrival, with a latency that "
                   "varies by {:.0f} ms (standard deviation); record the stamps of the sensor or "
                   "of its driver",
                   1e3 * least, 1e3 * most, 1e3 * latency)});
}

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
  findings.push_back(
      {DataFinding::Grade::kWarning, "imu_bursts",
       fmt::format("{:.0f} % of the inertial samples come {:.2g} ms after another, then none for "
                   "{:.3g} ms: their stamps are those of packets of {:.0f} samples (a FIFO); stamp "
                   "them at constant intervals of {:.4g} ms up to the last one of each packet",
                   100.0 - 100.0 / packet, 1e3 * medianOf(std::vector<double>(intervals)),
                   usual_ms * packet, packet, usual_ms)});
  return true;
}

}  // namespace perdure::replay
