// The inference process that `perdure inference swap` starts. It runs in its own session, so that
// it continues after the command has ended.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/base/subprocess.h"

namespace perdure::tools {

class Newcomer {
 public:
  /// Redirects standard output and standard error to the file `log`. Throws StartupError if the
  /// program cannot be run.
  Newcomer(const std::vector<std::string>& command, const std::string& log);

  pid_t pid() const { return process_.pid(); }
  /// Its exit status, or 128 + the signal that ended it; empty while it runs.
  std::optional<int> ended() { return process_.ended(); }
  /// Sends SIGTERM, and SIGKILL after 5 s. Returns after the process has ended.
  void stop() { process_.stop(std::chrono::seconds(5)); }
  /// The last line of its log, which explains why it ended.
  std::string lastLine() const;
  const std::string& log() const { return log_; }

 private:
  std::string log_;
  Subprocess process_;
};

}  // namespace perdure::tools
