// Detects repeated and missing messages. A message may arrive twice when the writer changes.
#pragma once

#include <cstdint>
#include <deque>
#include <set>
#include <utility>

namespace perdure::bus {

/// Stores the newest `capacity` identities (source instance, sequence number).
class Once {
 public:
  explicit Once(std::size_t capacity = 1024) : capacity_(capacity) {}

  bool first(std::uint64_t source, std::uint64_t sequence) {
    if (!seen_.emplace(source, sequence).second) {
      ++repeated_;
      return false;
    }
    order_.emplace_back(source, sequence);
    if (order_.size() > capacity_) {
      seen_.erase(order_.front());
      order_.pop_front();
    }
    return true;
  }
  std::uint64_t repeated() const { return repeated_; }

 private:
  using Identity = std::pair<std::uint64_t, std::uint64_t>;
  std::size_t capacity_;
  std::set<Identity> seen_;
  std::deque<Identity> order_;
  std::uint64_t repeated_ = 0;
};

/// Counts missing sequence numbers. Use one object for each camera's frames, and one for odometry.
class Gaps {
 public:
  /// Returns how many sequence numbers are missing between the newest earlier message of `source`
  /// and this one. Returns 0 for the first message of a source, and for repeated or late messages.
  std::uint64_t before(std::uint64_t source, std::uint64_t sequence) {
    const bool follows = any_ && source == source_;
    if (follows && sequence <= newest_) return 0;
    const std::uint64_t missed = follows ? sequence - newest_ - 1 : 0;
    any_ = true, source_ = source, newest_ = sequence;
    return missed;
  }

 private:
  bool any_ = false;
  std::uint64_t source_ = 0, newest_ = 0;
};

}  // namespace perdure::bus
