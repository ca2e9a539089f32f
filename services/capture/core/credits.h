// Records which frames have been answered in follow mode, so that slow readers lose no frames.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <string>

namespace perdure::capture {

/// Each expected answerer ("odometry", "detections") credits frames up to a sequence number. A
/// frame is open until all answerers have credited it.
class Credits {
 public:
  explicit Credits(std::size_t window) : window_(window) {}

  void expect(const std::string& answerer) { answered_.emplace(answerer, 0); }
  void sent(std::uint64_t sequence) { on_the_way_.push_back(sequence); }
  /// An answer for a frame also credits all earlier frames, because readers process frames in
  /// order.
  void credit(const std::string& answerer, std::uint64_t sequence) {
    const auto it = answered_.find(answerer);
    if (it == answered_.end()) return;
    if (sequence + 1 > it->second) it->second = sequence + 1;
    while (!on_the_way_.empty() && on_the_way_.front() < creditedByAll()) on_the_way_.pop_front();
  }
  bool maySend() const { return answered_.empty() || on_the_way_.size() < window_; }
  void giveUp() {
    if (!on_the_way_.empty()) on_the_way_.pop_front();
  }
  /// Returns the sequence number of the first open frame, or `next` if no frame before `next` is
  /// open.
  std::uint64_t firstOpen(std::uint64_t next) const {
    return on_the_way_.empty() ? next : on_the_way_.front();
  }

 private:
  std::uint64_t creditedByAll() const {
    std::uint64_t lowest = UINT64_MAX;
    for (const auto& [name, next] : answered_) lowest = next < lowest ? next : lowest;
    return lowest;
  }

  std::size_t window_;
  std::map<std::string, std::uint64_t> answered_;  ///< first sequence number not answered
  std::deque<std::uint64_t> on_the_way_;
};

}  // namespace perdure::capture
