// A program that runs in parallel with this one. No shell is used; the arguments are passed
// unchanged.
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
  std::vector<std::string> command{};  ///< program (from PATH if it has no '/'), arguments
  std::map<std::string, std::string> environment{};  ///< added to this process's environment
  std::filesystem::path folder{};  ///< working directory; empty: that of this process
  std::filesystem::path log{};     ///< output is appended to it; empty: this process's output
  bool own_session = false;        ///< the program does not receive Ctrl-C and has no input
  bool ends_with_parent = false;   ///< the program receives SIGTERM if this process ends first
};

/// Returns the path of the program: `name` itself if it contains a '/', otherwise the first match
/// in PATH. Returns nothing if PATH has no match.
std::optional<std::filesystem::path> findProgram(const std::string& name);

/// The destructor kills the process and waits for its end, unless leaveAlone() was called.
class Subprocess {
 public:
  /// Throws StartupError(kUnavailable) with "PROGRAM cannot be started: REASON" if the program
  /// cannot be run or the log cannot be written.
  explicit Subprocess(const ProgramOptions& options);
  ~Subprocess();
  Subprocess(const Subprocess&) = delete;
  Subprocess& operator=(const Subprocess&) = delete;

  pid_t pid() const { return pid_; }
  void signal(int number) const;
  /// Returns the exit status of the process, or 128 + the signal that ended it. Returns nothing
  /// while the process runs.
  std::optional<int> ended();
  int waitForEnd();
  /// Waits for at most `longest` and returns the status as ended() does.
  std::optional<int> wait(std::chrono::milliseconds longest);
  /// Sends SIGTERM, and SIGKILL after `patience`. Returns when the process has ended.
  void stop(std::chrono::milliseconds patience);
  void leaveAlone() { left_alone_ = true; }

 private:
  pid_t pid_ = 0;
  std::optional<int> status_;
  bool left_alone_ = false;
};

struct ProgramAnswer {
  int status = 0;      ///< exit status, like Subprocess::ended
  std::string output;  ///< text of both streams, in the order in which it was written
  bool too_late = false;
};

/// Runs a program to its end and returns its output; `options.log` must be empty. The program is
/// killed after `longest`. Throws like Subprocess.
ProgramAnswer runProgram(const ProgramOptions& options,
                         std::chrono::milliseconds longest = std::chrono::hours(1));

}  // namespace perdure
