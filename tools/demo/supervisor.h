// Runs supervisord as a child process: starts it, controls it by XML-RPC over its Unix socket, and
// ends it.
#pragma once

#include <map>
#include <optional>
#include <string>

#include "common/base/result.h"
#include "common/base/subprocess.h"

namespace perdure::tools {

struct ServiceState {
  std::string state;  ///< STOPPED, STARTING, RUNNING, BACKOFF, STOPPING, EXITED, FATAL, UNKNOWN
  std::string spawn_error;
  bool ended() const { return state == "STOPPED" || state == "EXITED" || state == "FATAL"; }
};

/// The processes in a response of supervisor.getAllProcessInfo. Empty if the response is malformed.
std::map<std::string, ServiceState> readProcessInfo(const std::string& xml);

/// Counts the starts of each program in the log of supervisord.
std::map<std::string, int> countSpawns(const std::string& log);

/// The last exit status of each program, from the log of supervisord. Its responses lack the status
/// of a program that ended too quickly.
std::map<std::string, int> lastExits(const std::string& log);

/// The error in the output of supervisord if it ended at once; empty if there is none.
std::string complaintIn(const std::string& output);

class Supervisor {
 public:
  /// Throws StartupError if supervisord is not installed, ends at once or does not respond.
  Supervisor(const std::string& config_file, const std::string& socket, const std::string& log);
  /// Ends supervisord and the programs that still run.
  ~Supervisor();
  Supervisor(const Supervisor&) = delete;
  Supervisor& operator=(const Supervisor&) = delete;

  Result<std::map<std::string, ServiceState>> states() const;
  /// Requests the end with SIGTERM and returns at once.
  void stop(const std::string& service) const;
  bool alive();

 private:
  Result<std::string> call(const std::string& method, const std::string& parameters) const;

  std::string socket_;
  std::optional<Subprocess> process_;
};

}  // namespace perdure::tools
