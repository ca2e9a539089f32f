// supervisord as a child: started, asked and told over its unix socket (XML-RPC), ended.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/base/subprocess.h"

namespace perdure::tools {

struct ServiceState {
  std::string state;  ///< STOPPED, STARTING, RUNNING, BACKOFF, STOPPING, EXITED, FATAL, UNKNOWN
  std::string spawn_error;
  bool ended() const { return state == "STOPPED" || state == "EXITED" || state == "FATAL"; }
};

/// The processes of an answer to supervisor.getAllProcessInfo. Empty where it is malformed.
std::map<std::string, ServiceState> readProcessInfo(const std::string& xml);

/// How often supervisord's log says that each program was started.
std::map<std::string, int> countSpawns(const std::string& log);

/// The last exit status of each program that exited, by supervisord's log (its answers do not tell
/// that of a program that ended too quickly).
std::map<std::string, int> lastExits(const std::string& log);

/// Why supervisord ended at once, in its own words as its output has them; empty where it has none.
std::string complaintIn(const std::string& output);

class Supervisor {
 public:
  /// Throws StartupError where supervisord is not installed, ends at once or does not answer.
  Supervisor(const std::string& config_file, const std::string& socket, const std::string& log);
  /// Ends supervisord, and with it what still runs.
  ~Supervisor();
  Supervisor(const Supervisor&) = delete;
  Supervisor& operator=(const Supervisor&) = delete;

  Result<std::map<std::string, ServiceState>> states() const;
  /// SIGTERM; returns at once.
  void stop(const std::string& service) const;
  bool alive();

 private:
  Result<std::string> call(const std::string& method, const std::string& parameters) const;

  std::string socket_;
  std::optional<Subprocess> process_;
};

}  // namespace perdure::tools
