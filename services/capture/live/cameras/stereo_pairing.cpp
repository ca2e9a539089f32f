#include "services/capture/live/cameras/stereo_pairing.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <utility>

namespace perdure::capture {
namespace {

constexpr double kMostTolerance_ns = 10e6;  // equal to vio's stereo.pair_tolerance
constexpr double kLeastInterval_ns = 2e6;
constexpr double kSilence = 4.0;  // after this many intervals without image a camera is silent
constexpr std::size_t kMostSeconds = 8;
constexpr std::size_t kJudged = 64;  // the pairing is assessed after this many images of cam0
constexpr double kTold_ms = 2.0;

}  // namespace

bool CameraTimeline::takes(const CameraImage& image, std::int64_t now_ns, double interval_ns) {
  arrived_ns_ = now_ns;
  if (static_cast<double>(image.time_ns - now_ns) > interval_ns) return false;
  const auto before = std::exchange(last_ns_, image.time_ns);
  const auto number = std::exchange(number_, image.number);
  if (!before) return true;
  if (image.time_ns <= *before) return false;
  if (image.number <= number) return true;
  const double period =
      static_cast<double>(image.time_ns - *before) / static_cast<double>(image.number - number);
  if (period > 2.0 * interval_ns) return true;  // the camera was absent
  period_ns_ += period_ns_ == 0.0 ? period : (period - period_ns_) / 8.0;
  return true;
}

bool CameraTimeline::flows(std::int64_t now_ns, double longest_ns) const {
  return arrived_ns_ && static_cast<double>(now_ns - *arrived_ns_) <= longest_ns;
}

StereoPairing::StereoPairing(double rate_hz) : asked_ns_(1e9 / rate_hz) {}

/// Returns the shorter interval of the two cameras, so that two images of a fast camera cannot
/// match the same image of the other.
double StereoPairing::intervalNs() const {
  double interval = asked_ns_;
  for (const double period : {first_.period_ns(), second_.period_ns()}) {
    if (period > 0.0) interval = std::min(interval, period);
  }
  return std::max(interval, kLeastInterval_ns);
}

std::int64_t StereoPairing::toleranceNs() const {
  return std::llround(std::min(intervalNs() / 3.0, kMostTolerance_ns));
}

std::vector<CameraImage> StereoPairing::first(CameraImage image, std::int64_t now_ns) {
  const bool in_order = first_.takes(image, now_ns, asked_ns_);
  if (!in_order) reasons_.add("camera_out_of_order_cam0");
  firsts_.push_back({std::move(image), now_ns, in_order});
  return due(now_ns);
}

std::vector<CameraImage> StereoPairing::second(CameraImage image, std::int64_t now_ns) {
  if (!second_.takes(image, now_ns, asked_ns_)) {
    reasons_.add("camera_out_of_order_cam1");
    return due(now_ns);
  }
  if (alone_ns_ && image.time_ns <= *alone_ns_ + toleranceNs()) ++late_;
  seconds_.push_back(std::move(image));
  return due(now_ns);
}

StereoPairing::Seconds::iterator StereoPairing::nearest(std::int64_t time_ns) {
  const auto apart = [&](const CameraImage& s) { return std::abs(s.time_ns - time_ns); };
  const auto best = std::ranges::min_element(
      seconds_, [&](const auto& a, const auto& b) { return apart(a) < apart(b); });
  return best != seconds_.end() && apart(*best) > toleranceNs() ? seconds_.end() : best;
}

bool StereoPairing::mayBePaired(const Waiting& first, std::int64_t now_ns) const {
  return first.in_order && now_ns < first.arrived_ns + toleranceNs() &&
         second_.last_ns() < first.image.time_ns + toleranceNs() &&
         second_.flows(now_ns, kSilence * intervalNs());
}

std::vector<CameraImage> StereoPairing::due(std::int64_t now_ns) {
  std::vector<CameraImage> result;
  for (; !firsts_.empty(); firsts_.pop_front()) {
    Waiting& first = firsts_.front();
    const auto partner = first.in_order ? nearest(first.image.time_ns) : seconds_.end();
    if (partner == seconds_.end()) {
      if (mayBePaired(first, now_ns)) break;
      goAlone(first, now_ns);
      result.push_back(std::move(first.image));
      continue;
    }
    CameraImage second = partnerOf(first, partner);
    result.push_back(std::move(first.image));
    result.push_back(std::move(second));
  }
  dropPassed();
  judge();
  return result;
}

void StereoPairing::goAlone(const Waiting& first, std::int64_t now_ns) {
  reasons_.add("stereo_unpaired_cam0");
  alone_ns_ = first.image.time_ns;
  if (second_.flows(now_ns, kSilence * intervalNs())) ++alone_;
}

CameraImage StereoPairing::partnerOf(const Waiting& first, Seconds::iterator partner) {
  dropSeconds(static_cast<std::size_t>(partner - seconds_.begin()));
  CameraImage second = std::move(seconds_.front());
  seconds_.pop_front();
  second.number = first.image.number;
  apart_ms_.push_back(1e-6 * static_cast<double>(std::abs(second.time_ns - first.image.time_ns)));
  return second;
}

void StereoPairing::dropSeconds(std::size_t n) {
  if (n > 0) reasons_.add("stereo_unpaired_cam1", n);
  seconds_.erase(seconds_.begin(), seconds_.begin() + static_cast<std::ptrdiff_t>(n));
}

/// Drops images of cam1 that are too old for any later image of cam0.
void StereoPairing::dropPassed() {
  const auto oldest = firsts_.empty() ? first_.last_ns() : firsts_.front().image.time_ns;
  std::size_t passed = 0;
  while (oldest && passed < seconds_.size() && seconds_[passed].time_ns < *oldest - toleranceNs()) {
    ++passed;
  }
  const std::size_t too_many = seconds_.size() > kMostSeconds ? seconds_.size() - kMostSeconds : 0;
  dropSeconds(std::max(passed, too_many));
}

void StereoPairing::judge() {
  if (apart_ms_.size() + alone_ < kJudged) return;
  problem_.clear();
  const double ms = 1e-6 * static_cast<double>(toleranceNs());
  if (alone_ > apart_ms_.size()) {
    problem_ = 2 * late_ > alone_
                   ? fmt::format(
                         "cam1's images come more than {:.1f} ms later than cam0's of the same "
                         "moment, which go without them; give cam1 a faster way (its own USB bus, "
                         "another camera.format, smaller images).",
                         ms)
                   : fmt::format(
                         "cam0 and cam1 take their images more than {:.1f} ms apart, and most of "
                         "cam0 go alone; trigger both by one signal, or set camera.rate_hz to a "
                         "rate that both have.",
                         ms);
  }
  judgeDifference();
  apart_ms_.clear();
  alone_ = late_ = 0;
}

/// Reports the time difference of the pairs, and again after a large change, because the phases of
/// free-running cameras drift.
void StereoPairing::judgeDifference() {
  if (apart_ms_.empty()) return note_.clear();
  const auto middle = apart_ms_.begin() + static_cast<std::ptrdiff_t>(apart_ms_.size() / 2);
  std::nth_element(apart_ms_.begin(), middle, apart_ms_.end());
  if (*middle <= kTold_ms) return note_.clear();
  if (!note_.empty() && std::abs(*middle - told_ms_) < std::max(1.0, told_ms_ / 4.0)) return;
  told_ms_ = *middle;
  note_ = fmt::format(
      "The images of cam0 and cam1 are typically {:.1f} ms apart, and vio takes them as one "
      "moment; "
      "trigger both by one signal where the vehicle moves fast.",
      told_ms_);
}

}  // namespace perdure::capture
