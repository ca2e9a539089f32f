// State of a live device, written by its own thread and read by others.
#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <mutex>
#include <string>
#include <thread>

#include "common/base/result.h"

namespace perdure::capture {

/// Joins two texts, with a separator if both are not empty.
inline std::string joined(const std::string& a, const std::string& b, const char* between = " ") {
  return a + (a.empty() || b.empty() ? "" : between) + b;
}

/// The state of one device. Thread-safe.
class DeviceState {
 public:
  explicit DeviceState(std::string problem) : problem_(std::move(problem)) {}

  /// Returns the problem as a sentence with the fix; empty while the device sends data.
  std::string problem() const { return locked(problem_); }
  std::string name() const { return locked(name_); }
  /// Returns the settings that the device does not apply; empty if it applies all.
  std::string note() const { return locked(note_); }
  ReasonCounts reasons() const { return locked(reasons_); }

  void flows(const std::string& name, const std::string& note = {}) {
    const std::lock_guard lock(mutex_);
    name_ = name;
    note_ = note;
    problem_.clear();
  }
  void fails(const Reason& reason) {
    const std::lock_guard lock(mutex_);
    reasons_.add(reason);
    problem_ = reason.detail;
    name_.clear();
    note_.clear();
  }
  void count(const std::string& reason, std::uint64_t n = 1) {
    const std::lock_guard lock(mutex_);
    reasons_.add(reason, n);
  }

 private:
  template <class T>
  T locked(const T& value) const {
    const std::lock_guard lock(mutex_);
    return value;
  }

  mutable std::mutex mutex_;
  std::string problem_, name_, note_;
  ReasonCounts reasons_;
};

/// Calls `flow` repeatedly until `stopping` is set. `flow` returns when the device is gone.
inline void keepOpen(const std::atomic<bool>& stopping, const std::function<void()>& flow) {
  constexpr std::chrono::milliseconds kPause{500};
  while (!stopping) {
    flow();
    for (auto left = kPause; !stopping && left.count() > 0; left -= kPause / 10) {
      std::this_thread::sleep_for(kPause / 10);
    }
  }
}

}  // namespace perdure::capture
