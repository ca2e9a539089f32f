// Follow mode: which frames are still on their way, so that none is lost to a slow reader.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <string>

namespace perdure::capture {

/// Each configured answerer ("odometry", "detections") credits frames up to a sequence number; a
/// frame is on its way until all have.
class Credits {
 public:
  explicit Credits(std::size_t window) : window_(window) {}

  void expect(const std::string& answerer) { answered_.emplace(answerer, 0); }
  void sent(std::uint64_t sequence) { on_the_way_.push_back(sequence); }
  /// An answer for a frame is one for all before it: its reader will not go back.
  void credit(const std::string& answerer, std::uint64_t sequence) {
    const auto it = answered_.find(answerer);
    if (it == answered_.end()) return;
    if (sequence + 1 > it->second) it->second = sequence + 1;
    while (!on_the_way_.empty() && on_the_way_.front() < creditedByAll()) on_the_way_.pop_front();
  }
  bool maySend() const { return answered_.empty() || on_the_way_.size() < window_; }
  /// Nobody answers: the oldest frame is given up.
  void giveUp() {
    if (!on_the_way_.empty()) on_the_way_.pop_front();
  }
  /// The first sequence number that is still on its way, or `next` where none is.
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
  std::map<std::string, std::uint64_t> answered_;  ///< the first sequence not yet answered
  std::deque<std::uint64_t> on_the_way_;
};

}  // namespace perdure::capture
