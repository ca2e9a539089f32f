// Detects faults: a process that reports one, or a process that became silent.
#pragma once

#include <chrono>
#include <map>
#include <optional>
#include <string>

#include "common/types/health.h"

namespace perdure::tools {

class FaultWatch {
 public:
  using Time = std::chrono::steady_clock::time_point;

  /// `from`: the first state that is a fault; kFailed, or kDegraded.
  explicit FaultWatch(HealthState from = HealthState::kFailed) : from_(from) {}

  /// A description, if this message is a process's transition to a fault.
  std::optional<std::string> onHealth(const Health& health, Time now);
  /// If more `health` writers missed their lease. An orderly shutdown removes the writer.
  std::optional<std::string> onSilent(std::size_t silent, Time now);

 private:
  struct Process {
    HealthState state = HealthState::kStarting;
    Time heard{};
  };
  const HealthState from_;
  std::map<std::string, Process> processes_;
  std::size_t silent_ = 0;
};

}  // namespace perdure::tools
