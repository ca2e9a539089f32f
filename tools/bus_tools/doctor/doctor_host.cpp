#include <arpa/inet.h>
#include <net/if.h>
#include <netinet/in.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/timex.h>
#include <unistd.h>

#include <cstring>
#include <filesystem>
#include <fstream>

#include "common/base/process/descriptor.h"
#include "tools/bus_tools/doctor/doctor.h"

namespace perdure::tools {
namespace {

Descriptor datagramSocket() { return Descriptor(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)); }

Finding checkReceiveBuffer() {
  constexpr long kEnough = 4 << 20;  // size of three colour images
  std::ifstream file("/proc/sys/net/core/rmem_max");
  long bytes = 0;
  if (!(file >> bytes)) return {Verdict::kWarn, "net.core.rmem_max cannot be read"};
  const std::string text = "net.core.rmem_max is " + std::to_string(bytes) + " bytes";
  if (bytes >= kEnough) return {Verdict::kOk, text};
  return {Verdict::kWarn,
          text + "; image streams may lose frames: `sysctl -w net.core.rmem_max=10485760`"};
}

Finding checkInterface(const std::string& name) {
  const Descriptor s = datagramSocket();
  ifreq request{};
  std::strncpy(request.ifr_name, name.c_str(), IFNAMSIZ - 1);
  if (ioctl(s.get(), SIOCGIFFLAGS, &request) != 0) {
    return {Verdict::kFail, "there is no interface " + name + "; `ip link` lists them"};
  }
  if ((request.ifr_flags & IFF_UP) == 0) {
    return {Verdict::kFail, name + " is down: `ip link set " + name + " up`"};
  }
  return {Verdict::kOk, name + " is up"};
}

bool datagramPasses(std::size_t size) {
  const Descriptor receiver = datagramSocket(), sender = datagramSocket();
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t length = sizeof(address);
  auto* generic = reinterpret_cast<sockaddr*>(&address);
  if (bind(receiver.get(), generic, sizeof(address)) != 0) return false;
  if (getsockname(receiver.get(), generic, &length) != 0) return false;
  const timeval patience{1, 0};
  setsockopt(receiver.get(), SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof(patience));
  std::vector<char> bytes(size);
  if (sendto(sender.get(), bytes.data(), size, 0, generic, sizeof(address)) < 0) return false;
  return recv(receiver.get(), bytes.data(), size, 0) == static_cast<ssize_t>(size);
}

Finding checkDatagrams() {
  constexpr std::size_t kMessage = 65500;  // MaxMessageSize of the loopback configuration
  if (datagramPasses(kMessage)) return {Verdict::kOk, "65500-byte datagrams pass over loopback"};
  return {Verdict::kFail,
          "a 65500-byte datagram does not pass over 127.0.0.1; is loopback up, or does a firewall "
          "drop UDP?"};
}

Finding checkClock(const std::string& interface) {
  if (interface == "lo") {
    return {Verdict::kOk, "one host: latency is measured by CLOCK_MONOTONIC"};
  }
  timex status{};
  const bool synchronised = adjtimex(&status) != TIME_ERROR && (status.status & STA_UNSYNC) == 0;
  if (synchronised) return {Verdict::kOk, "the system clock is synchronised"};
  return {Verdict::kWarn,
          "the system clock is not synchronised; across hosts run ptp4l and phc2sys, or chrony"};
}

}  // namespace

Findings checkHost(const bus::Options& options) {
  return {checkReceiveBuffer(), checkInterface(options.interface), checkDatagrams(),
          checkClock(options.interface)};
}

Finding checkWritable(const std::string& folder) {
  constexpr std::uintmax_t kLittle = 1u << 30;
  std::error_code error;
  if (!std::filesystem::is_directory(folder, error)) {
    return {Verdict::kFail, folder + " is not a folder: `mkdir -p " + folder + "`"};
  }
  if (access(folder.c_str(), W_OK) != 0) {
    return {Verdict::kFail, folder + " is not writable: give it to the user of the services"};
  }
  const std::uintmax_t free = std::filesystem::space(folder, error).available;
  if (!error && free < kLittle) {
    return {Verdict::kWarn, folder + " has only " + std::to_string(free >> 20) + " MB left"};
  }
  return {Verdict::kOk, folder + " is writable"};
}

}  // namespace perdure::tools
