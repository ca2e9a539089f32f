// Waits in tests of the bus.
#pragma once

#include <chrono>

#include "common/bus/wait_loop.h"

namespace perdure::bus {

/// Steps the loop until `done` returns true, but at most twenty seconds.
template <class Done>
bool runUntil(WaitLoop& loop, Done done) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  while (!done() && std::chrono::steady_clock::now() < end) {
    loop.runOnce(std::chrono::milliseconds(20));
  }
  return done();
}

}  // namespace perdure::bus
