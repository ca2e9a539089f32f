#include "services/vio/waiting_frames.h"

#include <algorithm>
#include <chrono>

namespace perdure::vio {

constexpr std::size_t kUnpaired = 4;
constexpr std::size_t kAlone = 10;  // unpaired frames in a row: second camera absent
constexpr std::chrono::milliseconds kReordered{300};  // largest reordering by transports

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
  trouble_.clear();
  if (isLate(frame)) return fail("frame_late");
  if (pair(frame)) return {};
  seconds_.push_back(frame);
  if (seconds_.size() <= kUnpaired) return {};
  seconds_.pop_front();
  trouble_ = "its stamps differ from those of the first by more than stereo.pair_tolerance";
  return fail("stereo_unpaired");
}

/// Returns true if the frame's pair was already taken. A late frame of a missed pair also shows
/// that the second camera works again.
bool WaitingFrames::isLate(const Frame& second) {
  if (!taken_ || second.stamp.time > *taken_ + tolerance_) return false;
  trouble_ = "its images come too late";
  if (std::any_of(missed_.begin(), missed_.end(), [&](TimePoint first) {
        return std::chrono::abs(second.stamp.time - first) <= tolerance_;
      })) {
    missed_.clear();
  }
  return true;
}

FramePair WaitingFrames::take() {
  FramePair next = std::move(pairs_.front());
  pairs_.pop_front();
  taken_ = next.first.stamp.time;
  if (next.second) {
    alone_ = 0;
    missed_.clear();
    return next;
  }
  ++alone_;
  missed_.push_back(*taken_);
  if (missed_.size() > kAlone) missed_.pop_front();
  return next;
}

bool WaitingFrames::frontMayBePaired() const {
  if (pairs_.front().second || missed_.size() >= kAlone) return false;
  if (pairs_.size() > 1 && (pairs_[1].second || pairs_.size() > 3)) return false;
  const TimePoint last = pairs_.front().first.stamp.time + tolerance_;
  return std::none_of(seconds_.begin(), seconds_.end(),
                      [&](const Frame& f) { return f.stamp.time > last; });
}

std::string WaitingFrames::whyAlone() const {
  if (alone_ < static_cast<int>(kAlone)) return {};
  return "continues with one camera, because no image of the second one fits: " +
         (trouble_.empty() ? "none comes" : trouble_) +
         "; fix that camera, or set stereo.enabled to false";
}

void WaitingFrames::clear() {
  pairs_.clear();
  seconds_.clear();
  missed_.clear();
  taken_.reset();
}

}  // namespace perdure::vio
