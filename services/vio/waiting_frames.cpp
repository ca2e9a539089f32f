#include "services/vio/waiting_frames.h"

#include <algorithm>
#include <chrono>

namespace perdure::vio {
namespace {

constexpr std::size_t kUnpaired = 4;
constexpr std::chrono::milliseconds kReordered{300};  // by transports, at most

}  // namespace

Result<void> WaitingFrames::addFirst(const Frame& frame) {
  const bool earlier_run = std::erase_if(pairs_, [&](const FramePair& waiting) {
                             return waiting.first.stamp.time > frame.stamp.time + kReordered;
                           }) > 0;
  const auto later = std::find_if(pairs_.begin(), pairs_.end(), [&](const FramePair& p) {
    return p.first.stamp.time >= frame.stamp.time;
  });
  const bool reordered = later != pairs_.end();
  if (reordered && later->first.stamp.time == frame.stamp.time) return fail("frame_duplicate");
  pairs_.insert(later, FramePair{frame, {}});
  std::erase_if(seconds_, [&](const Frame& waiting) { return pair(waiting); });
  if (earlier_run) return fail("frame_of_earlier_run");
  if (reordered) return fail("frame_reordered");
  return {};
}

bool WaitingFrames::pair(const Frame& second) {
  for (FramePair& p : pairs_) {
    if (std::chrono::abs(second.stamp.time - p.first.stamp.time) > tolerance_) continue;
    p.second = second;
    return true;
  }
  return false;
}

Result<void> WaitingFrames::addSecond(const Frame& frame) {
  std::erase_if(seconds_, [&](const Frame& waiting) {
    return waiting.stamp.time > frame.stamp.time + kReordered;
  });
  if (pair(frame)) return {};
  seconds_.push_back(frame);
  if (seconds_.size() <= kUnpaired) return {};
  seconds_.pop_front();
  return fail("stereo_unpaired");
}

FramePair WaitingFrames::take() {
  FramePair next = std::move(pairs_.front());
  pairs_.pop_front();
  return next;
}

bool WaitingFrames::frontMayBePaired() const {
  if (pairs_.front().second) return false;
  if (pairs_.size() > 1 && (pairs_[1].second || pairs_.size() > 3)) return false;
  const TimePoint last = pairs_.front().first.stamp.time + tolerance_;
  return std::none_of(seconds_.begin(), seconds_.end(),
                      [&](const Frame& f) { return f.stamp.time > last; });
}

void WaitingFrames::clear() {
  pairs_.clear();
  seconds_.clear();
}

}  // namespace perdure::vio
