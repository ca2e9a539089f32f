#include "common/bus/shared_memory.h"

#include <fmt/format.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>

#include "common/base/ids.h"

namespace perdure::bus {
namespace {

constexpr char kSocket[] = "/tmp/roudi";  // fixed path in iceoryx 2.0
constexpr char kManagement[] = "/dev/shm/iceoryx_mgmt";

/// Returns 0 if a process listens on the socket, else errno.
int connectToRouDi() {
  const int fd = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (fd < 0) return errno;
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::strncpy(address.sun_path, kSocket, sizeof(address.sun_path) - 1);
  const bool connected =
      connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0;
  const int error = connected ? 0 : errno;
  close(fd);
  return error;
}

std::string bootId() {
  std::ifstream file("/proc/sys/kernel/random/boot_id");
  std::string id;
  file >> id;
  return id;
}

}  // namespace

Result<std::string> sharedMemoryLocator() {
  if (const int error = connectToRouDi(); error == EACCES) {
    return fail("no_roudi",
                "RouDi's socket /tmp/roudi is not for this user; put it in RouDi's group");
  } else if (error != 0) {
    return fail("no_roudi",
                "RouDi does not answer at /tmp/roudi; start `iox-roudi -m off -c "
                "deploy/roudi.toml` before the services");
  }
  struct stat segment {};
  if (stat(kManagement, &segment) != 0) {
    return fail("no_roudi",
                "RouDi answers, but its memory /dev/shm/iceoryx_mgmt is not in sight; "
                "services and RouDi need the same /dev/shm");
  }
  // Each start of RouDi creates a file with a new inode. The boot id distinguishes hosts.
  const std::uint64_t identity =
      digest(fmt::format("{} {} {}", bootId(), segment.st_dev, segment.st_ino));
  std::string locator = "iceoryx/00:00:00:00:00:00:00:00";
  for (int shift = 56; shift >= 0; shift -= 8) {
    locator += fmt::format(":{:02x}", (identity >> shift) & 0xff);
  }
  return locator;
}

}  // namespace perdure::bus
