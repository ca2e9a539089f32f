// The inference process that `perdure inference swap` starts. It is not tied to the command: it
// lives on, in a session of its own, whatever becomes of who started it.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/base/subprocess.h"

namespace perdure::tools {

class Newcomer {
 public:
  /// Standard output and error go to the file `log`. Throws StartupError where it cannot be run.
  Newcomer(const std::vector<std::string>& command, const std::string& log);

  pid_t pid() const { return process_.pid(); }
  /// Its exit status, or 128 + the signal that ended it; nothing while it runs.
  std::optional<int> ended() { return process_.ended(); }
  /// SIGTERM; after some seconds SIGKILL. Returns when it is gone.
  void stop() { process_.stop(std::chrono::seconds(5)); }
  /// The last line that it logged, which says why it ended.
  std::string lastLine() const;
  const std::string& log() const { return log_; }

 private:
  std::string log_;
  Subprocess process_;
};

}  // namespace perdure::tools
