// A bounded queue between two threads, with a named policy for a full queue and a count of drops.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>

#include "common/base/check.h"

namespace perdure {

enum class Overflow {
  kDropOldest,  ///< the oldest element is dropped and counted
  kBlock,       ///< the producer waits; nothing is lost
};

template <class T>
class BoundedQueue {
 public:
  BoundedQueue(std::size_t capacity, Overflow policy) : capacity_(capacity), policy_(policy) {
    check(capacity > 0, "a queue holds at least one element");
  }

  /// Appends the value. Returns false if the queue is closed.
  bool push(T value) {
    std::unique_lock lock(mutex_);
    if (policy_ == Overflow::kBlock) {
      not_full_.wait(lock, [&] { return closed_ || queue_.size() < capacity_; });
    }
    if (closed_) return false;
    while (queue_.size() >= capacity_) {
      queue_.pop_front();
      ++dropped_;
    }
    queue_.push_back(std::move(value));
    not_empty_.notify_one();
    return true;
  }

  /// Waits for an element. Returns nothing if the queue is closed and empty.
  std::optional<T> pop() {
    std::unique_lock lock(mutex_);
    not_empty_.wait(lock, [&] { return closed_ || !queue_.empty(); });
    return takeFront();
  }

  /// Waits for an element, at most for `longest`. Returns nothing if there is still none.
  std::optional<T> popWithin(std::chrono::nanoseconds longest) {
    std::unique_lock lock(mutex_);
    not_empty_.wait_for(lock, longest, [&] { return closed_ || !queue_.empty(); });
    return takeFront();
  }

  std::optional<T> tryPop() {
    const std::lock_guard lock(mutex_);
    return takeFront();
  }

  void close() {
    const std::lock_guard lock(mutex_);
    closed_ = true;
    not_empty_.notify_all();
    not_full_.notify_all();
  }

  std::uint64_t dropped() const {
    const std::lock_guard lock(mutex_);
    return dropped_;
  }

 private:
  std::optional<T> takeFront() {
    if (queue_.empty()) return std::nullopt;
    T value = std::move(queue_.front());
    queue_.pop_front();
    not_full_.notify_one();
    return value;
  }

  const std::size_t capacity_;
  const Overflow policy_;
  mutable std::mutex mutex_;
  std::condition_variable not_empty_, not_full_;
  std::deque<T> queue_;
  std::uint64_t dropped_ = 0;
  bool closed_ = false;
};

}  // namespace perdure
