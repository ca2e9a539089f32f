// A program that runs beside this one: no shell, its arguments as they are.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace perdure {

struct ProgramOptions {
  std::vector<std::string> command{};  ///< the program (in PATH if it has no '/'); its arguments
  std::map<std::string, std::string> environment{};  ///< beside, or in place of, this process's own
  std::filesystem::path folder{};  ///< where it works; empty: where this process does
  std::filesystem::path log{};    ///< what it prints is appended here; empty: where this one prints
  bool own_session = false;       ///< Ctrl-C does not reach it, and it reads nothing
  bool ends_with_parent = false;  ///< SIGTERM where this process dies before it
};

/// Where the program lies: `name` itself where it has a '/', else the first in PATH.
std::optional<std::filesystem::path> findProgram(const std::string& name);

/// Killed and waited for at the end of the scope, unless it is left alone.
class Subprocess {
 public:
  /// Throws StartupError(kUnavailable), "PROGRAM cannot be started: why", also where the log cannot
  /// be written.
  explicit Subprocess(const ProgramOptions& options);
  ~Subprocess();
  Subprocess(const Subprocess&) = delete;
  Subprocess& operator=(const Subprocess&) = delete;

  pid_t pid() const { return pid_; }
  void signal(int number) const;
  /// Its exit status, or 128 + the signal that ended it; nothing while it runs.
  std::optional<int> ended();
  /// The same, when it has ended.
  int waitForEnd();
  /// The same, after at most `longest`.
  std::optional<int> wait(std::chrono::milliseconds longest);
  /// SIGTERM, and SIGKILL where that has not ended it after `patience`. Returns when it is gone.
  void stop(std::chrono::milliseconds patience);
  /// It may live on after this object.
  void leaveAlone() { left_alone_ = true; }

 private:
  pid_t pid_ = 0;
  std::optional<int> status_;
  bool left_alone_ = false;
};

struct ProgramAnswer {
  int status = 0;      ///< as of Subprocess::ended
  std::string output;  ///< both streams, in the order in which they were written
  bool too_late = false;
};

/// Runs a program to its end and keeps what it prints (`options.log` must be empty). Killed after
/// `longest`. Throws as Subprocess does.
ProgramAnswer runProgram(const ProgramOptions& options,
                         std::chrono::milliseconds longest = std::chrono::hours(1));

}  // namespace perdure
