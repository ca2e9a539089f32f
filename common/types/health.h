// The state of each process. Every process publishes it, keyed by process.
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "common/base/ids.h"

namespace perdure {

enum class HealthState : std::uint8_t { kStarting = 0, kOk = 1, kDegraded = 2, kFailed = 3 };

struct Health {
  std::string process;  ///< "capture", "vio", …; the key, together with the vehicle
  InstanceId instance = 0;
  std::uint32_t pid = 0;
  HealthState state = HealthState::kStarting;
  std::string message;  ///< one sentence: the fault and its fix, or the cause of waiting
  std::uint64_t frames_in = 0, frames_out = 0, dropped = 0;
  double rate_hz = 0.0;  ///< rate of frames_out, over the last seconds
  double cpu_s = 0.0;    ///< processor time since the start
  std::uint64_t rss_bytes = 0;
  std::map<std::string, std::uint64_t> reasons;  ///< counted reasons, including those of DDS
};

}  // namespace perdure
