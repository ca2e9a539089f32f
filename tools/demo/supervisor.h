// Keeps the services of the demo running: starts them, and restarts those that fail.
#pragma once

#include <chrono>
#include <list>
#include <optional>
#include <string>
#include <vector>

#include "common/base/subprocess.h"
#include "tools/demo/plan.h"

namespace perdure::tools {

class Supervisor {
 public:
  /// Starts all services in `folder`. Throws StartupError if a program cannot be run.
  Supervisor(const std::vector<ServicePlan>& services, const std::filesystem::path& folder);
  /// Ends the services that still run by SIGTERM, or by SIGKILL after five seconds.
  ~Supervisor();
  Supervisor(const Supervisor&) = delete;
  Supervisor& operator=(const Supervisor&) = delete;

  /// Restarts failed services; call it often. A service that failed after its first second is
  /// restarted at once, without a limit. A service that failed earlier is tried five times, with
  /// pauses of 1, 2, 3 and 4 seconds. Throws StartupError with the last line of its log if all
  /// tries failed, or if its exit status means that it cannot start.
  void watch();
  /// Ends a service by SIGTERM, without a restart. Does not wait for the end.
  void stop(const std::string& service);
  bool runs(const std::string& service);
  int starts(const std::string& service) const;

 private:
  using Clock = std::chrono::steady_clock;
  struct Program {
    ServicePlan plan;
    std::optional<Subprocess> process = {};
    Clock::time_point started = {};
    std::optional<Clock::time_point> again = {};  ///< time of the next start after a failure
    int starts = 0, failures = 0;                 ///< failures: successive ones in the first second
    bool stopped = false;
  };
  void start(Program& program);
  Program& named(const std::string& service);

  const std::filesystem::path folder_;
  std::list<Program> programs_;
};

}  // namespace perdure::tools
