#include "tests/common/bus/isolation.h"

#include <fcntl.h>
#include <net/if.h>
#include <sched.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>
#include <string>

#include "common/base/check.h"

namespace perdure::tests {
namespace {

bool loopbackUp() {
  const int s = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (s < 0) return false;
  ifreq request{};
  std::strncpy(request.ifr_name, "lo", IFNAMSIZ - 1);
  bool up = ioctl(s, SIOCGIFFLAGS, &request) == 0;
  request.ifr_flags = static_cast<short>(request.ifr_flags | IFF_UP | IFF_RUNNING);
  up = up && ioctl(s, SIOCSIFFLAGS, &request) == 0;
  close(s);
  return up;
}

/// Selects a domain and locks it for the lifetime of this process.
void leaseDomain() {
  constexpr int kFirst = 100, kLast = 199;
  for (int domain = kFirst; domain <= kLast; ++domain) {
    const std::string path = "/tmp/perdure-test-domain-" + std::to_string(domain) + ".lock";
    const int file = open(path.c_str(), O_CREAT | O_RDWR, 0666);  // child processes inherit the
                                                                  // lock
    if (file >= 0 && flock(file, LOCK_EX | LOCK_NB) == 0) {
      setenv("PERDURE_DOMAIN", std::to_string(domain).c_str(), 1);
      return;
    }
    if (file >= 0) close(file);
  }
  check(false, "one of the domains 100 to 199 is free for a test");
}

}  // namespace

void isolateNetwork() {
  unsetenv("CYCLONEDDS_URI");
  const bool isolated = unshare(CLONE_NEWNET) == 0 || unshare(CLONE_NEWUSER | CLONE_NEWNET) == 0;
  if (!isolated || !loopbackUp()) leaseDomain();
}

}  // namespace perdure::tests
