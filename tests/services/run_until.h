// Waits for messages in a test.
#pragma once

#include <chrono>
#include <functional>

#include "common/bus/wait_loop.h"

namespace perdure::test {

/// Runs the loop until `done` returns true; returns false after `limit`. The limit is generous,
/// because it only ends a test that would hang.
inline bool runUntil(bus::WaitLoop& loop, const std::function<bool()>& done,
                     std::chrono::seconds limit = std::chrono::seconds(20)) {
  const auto end = std::chrono::steady_clock::now() + limit;
  while (!done()) {
    if (std::chrono::steady_clock::now() > end) return false;
    loop.runOnce(std::chrono::milliseconds(5));
  }
  return true;
}

}  // namespace perdure::test
