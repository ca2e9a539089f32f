// What counts as a fault: a process that says so, or one that says nothing any more.
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

  /// What happened, where a process goes over to a fault with this message.
  std::optional<std::string> onHealth(const Health& health, Time now);
  /// The same by how many writers of `health` are there, but missed their lease. An ordered end is
  /// no fault: its writer is gone then.
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
