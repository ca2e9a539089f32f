// Reasons why a program cannot start, with the exit status of sysexits.h.
#pragma once

#include <fmt/core.h>

#include <stdexcept>
#include <string>
#include <utility>

namespace perdure {

enum class ExitCode : int {
  kOk = 0,
  kFailure = 1,
  kUsage = 64,          ///< wrong command line
  kData = 65,           ///< the data exist, but cannot be used as they are
  kUnavailable = 69,    ///< a device, file or folder is missing or unreadable
  kInputOutput = 74,    ///< a write failed, for example because the disk is full
  kConfiguration = 78,  ///< the configuration is wrong
};

/// Thrown only before a service runs, and caught once in runService (or in main of a tool). The
/// message states the fix.
class StartupError : public std::runtime_error {
 public:
  StartupError(ExitCode code, const std::string& message)
      : std::runtime_error(message), code_(code) {}
  template <class First, class... More>
  StartupError(ExitCode code, fmt::format_string<First, More...> format, First&& first,
               More&&... more)
      : StartupError(
            code, fmt::format(format, std::forward<First>(first), std::forward<More>(more)...)) {}
  ExitCode code() const { return code_; }

 private:
  ExitCode code_;
};

}  // namespace perdure
