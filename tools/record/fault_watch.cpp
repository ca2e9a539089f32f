#include "tools/record/fault_watch.h"

namespace perdure::tools {

std::optional<std::string> FaultWatch::onHealth(const Health& health, Time now) {
  Process& process = processes_[health.process];
  const bool was = process.state >= from_, is = health.state >= from_;
  process = {health.state, now};
  if (was || !is) return std::nullopt;
  const char* how = health.state == HealthState::kFailed ? " has failed" : " is degraded";
  return health.process + how + (health.message.empty() ? "" : ": " + health.message);
}

std::optional<std::string> FaultWatch::onSilent(std::size_t silent, Time now) {
  const bool more = silent > silent_;
  silent_ = silent;
  if (!more) return std::nullopt;
  constexpr std::chrono::milliseconds kLease(900);  // lease of health; its period is a second
  std::string name = "a process";
  Time oldest = now - kLease;
  for (const auto& [process, seen] : processes_) {
    if (seen.heard >= oldest) continue;
    oldest = seen.heard;
    name = process;
  }
  return name + " is silent";
}

}  // namespace perdure::tools
