// Ends the waits of another thread.
#pragma once

#include <sys/eventfd.h>
#include <unistd.h>

#include <cstdint>

#include "common/base/check.h"

namespace perdure::map_store::fleet {

class Stop {
 public:
  Stop() : file_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
    perdure::check(file_ >= 0, "a process has a file descriptor left");
  }
  ~Stop() { close(file_); }
  Stop(const Stop&) = delete;
  Stop& operator=(const Stop&) = delete;
  /// May be called from any thread; cannot be undone.
  void raise() const {
    const std::uint64_t one = 1;
    (void)!write(file_, &one, sizeof one);
  }
  int file() const { return file_; }  ///< becomes readable once raised

 private:
  int file_;
};

}  // namespace perdure::map_store::fleet
