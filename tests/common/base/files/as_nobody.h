// Drops the rights of root for a test of permissions.
#pragma once

#include <unistd.h>

namespace perdure::tests {

/// Until the end of its scope this process has the rights of `nobody`, if it runs as root.
class AsNobody {
 public:
  AsNobody() : was_root_(geteuid() == 0 && seteuid(kNobody) == 0) {}
  ~AsNobody() {
    if (was_root_ && seteuid(0) != 0) _exit(1);
  }
  AsNobody(const AsNobody&) = delete;
  AsNobody& operator=(const AsNobody&) = delete;

 private:
  static constexpr uid_t kNobody = 65534;
  bool was_root_;
};

}  // namespace perdure::tests
