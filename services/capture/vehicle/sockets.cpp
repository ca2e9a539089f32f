// Opens the sockets for a vehicle's speed and position.
#include <arpa/inet.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <linux/can.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <netdb.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <memory>
#include <vector>

#include "services/capture/vehicle/socket_stream.h"

namespace perdure::capture {
namespace {

constexpr int kConnect_ms = 2000;

/// Closes the socket, and returns the reason of its failure from errno.
tl::unexpected<Reason> failed(int socket, const std::string& what) {
  const std::string why = std::strerror(errno);
  if (socket >= 0) ::close(socket);
  return fail("socket", fmt::format("{}: {}", what, why));
}

struct AddressDeleter {
  void operator()(addrinfo* list) const { ::freeaddrinfo(list); }
};
using Addresses = std::unique_ptr<addrinfo, AddressDeleter>;

/// Resolves HOST:PORT or [HOST]:PORT.
Result<Addresses> resolve(const std::string& address, int type) {
  const auto colon = address.rfind(':');
  if (colon == std::string::npos || colon + 1 == address.size()) {
    return fail("socket", fmt::format("\"{}\" is not HOST:PORT", address));
  }
  std::string host = address.substr(0, colon);
  if (host.size() > 2 && host.front() == '[' && host.back() == ']') {
    host = host.substr(1, host.size() - 2);
  }
  addrinfo hints{};
  hints.ai_socktype = type;
  addrinfo* list = nullptr;
  const int code = ::getaddrinfo(host.c_str(), address.c_str() + colon + 1, &hints, &list);
  if (code != 0) return fail("socket", fmt::format("\"{}\": {}", address, ::gai_strerror(code)));
  return Addresses(list);
}

/// Returns whether the socket connects within two seconds.
bool connects(int socket, const addrinfo& to) {
  if (::connect(socket, to.ai_addr, to.ai_addrlen) == 0) return true;
  if (errno != EINPROGRESS) return false;
  pollfd wait{socket, POLLOUT, 0};
  if (::poll(&wait, 1, kConnect_ms) != 1) {
    errno = ETIMEDOUT;
    return false;
  }
  int error = 0;
  socklen_t size = sizeof error;
  (void)::getsockopt(socket, SOL_SOCKET, SO_ERROR, &error, &size);
  errno = error;
  return error == 0;
}

Result<int> openCan(const std::string& interface, const std::vector<std::uint32_t>& ids) {
  const int socket = ::socket(PF_CAN, SOCK_RAW | SOCK_CLOEXEC, CAN_RAW);
  if (socket < 0) {
    return failed(socket, "this kernel gives no socket of a CAN bus (modprobe can_raw)");
  }
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = static_cast<int>(::if_nametoindex(interface.c_str()));
  if (address.can_ifindex == 0) {
    return failed(socket, fmt::format("no network interface {} (`ip link` lists them; `ip link set "
                                      "{} up type can bitrate 500000` brings a CAN bus up)",
                                      interface, interface));
  }
  std::vector<can_filter> filters;
  for (const auto id : ids) {
    const canid_t mask = (id & CAN_EFF_FLAG) != 0 ? CAN_EFF_MASK : CAN_SFF_MASK;
    filters.push_back({id, mask | CAN_EFF_FLAG | CAN_RTR_FLAG});
  }
  const int on = 1;
  (void)::setsockopt(socket, SOL_CAN_RAW, CAN_RAW_FD_FRAMES, &on, sizeof on);
  if (::setsockopt(socket, SOL_CAN_RAW, CAN_RAW_FILTER, filters.data(),
                   static_cast<socklen_t>(filters.size() * sizeof(can_filter))) != 0 ||
      ::bind(socket, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    return failed(socket, fmt::format("{} is no CAN bus that can be read", interface));
  }
  return socket;
}

Result<int> openUdp(const std::string& address) {
  const auto at = resolve(address, SOCK_DGRAM);
  if (!at) return tl::unexpected(at.error());
  const int socket = ::socket((*at)->ai_family, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (socket < 0 || ::bind(socket, (*at)->ai_addr, (*at)->ai_addrlen) != 0) {
    return failed(socket, fmt::format("{} cannot be listened to", address));
  }
  return socket;
}

Result<int> openTcp(const std::string& address, const std::string& greeting) {
  const auto at = resolve(address, SOCK_STREAM);
  if (!at) return tl::unexpected(at.error());
  const int socket = ::socket((*at)->ai_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (socket < 0 || !connects(socket, **at) ||
      ::send(socket, greeting.data(), greeting.size(), MSG_NOSIGNAL) !=
          static_cast<ssize_t>(greeting.size())) {
    return failed(socket, fmt::format("nothing answers at {}; is gpsd running there?", address));
  }
  return socket;
}

}  // namespace

OpenSocket canSocket(std::string interface, std::vector<std::uint32_t> ids) {
  return
      [interface = std::move(interface), ids = std::move(ids)] { return openCan(interface, ids); };
}

OpenSocket udpSocket(std::string address) {
  return [address = std::move(address)] { return openUdp(address); };
}

OpenSocket tcpSocket(std::string address, std::string greeting) {
  return [address = std::move(address), greeting = std::move(greeting)] {
    return openTcp(address, greeting);
  };
}

}  // namespace perdure::capture
