#include "services/capture/vehicle/socket_stream.h"

#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>
#include <time.h>

#include <array>
#include <cerrno>
#include <cstring>

#include "common/base/process/descriptor.h"
#include "services/capture/live/clocks.h"

namespace perdure::capture {
namespace {

constexpr int kPoll_ms = 100;  // longest delay until a stop takes effect
constexpr std::size_t kLongestLine = 4096;

/// Returns the kernel's stamp of arrival if the message has one; otherwise the current time.
std::int64_t arrivalOf(msghdr& message) {
  for (cmsghdr* c = CMSG_FIRSTHDR(&message); c; c = CMSG_NXTHDR(&message, c)) {
    if (c->cmsg_level != SOL_SOCKET || c->cmsg_type != SCM_TIMESTAMPNS) continue;
    timespec stamp{};
    std::memcpy(&stamp, CMSG_DATA(c), sizeof stamp);
    return stamp.tv_sec * 1'000'000'000LL + stamp.tv_nsec + HostClock::realtimeToBootNs();
  }
  return HostClock::nowNs();
}

/// Returns whether the socket is a stream. Zero bytes mean the end of a stream, but a datagram may
/// be empty.
bool isStream(int socket) {
  int type = 0;
  socklen_t size = sizeof type;
  return ::getsockopt(socket, SOL_SOCKET, SO_TYPE, &type, &size) == 0 && type == SOCK_STREAM;
}

}  // namespace

SocketStream::SocketStream(std::string kind, std::string name, std::chrono::nanoseconds silence,
                           OpenSocket open, std::function<void(const Packet&)> give)
    : kind_(std::move(kind)),
      name_(std::move(name)),
      silence_(silence),
      open_(std::move(open)),
      give_(std::move(give)),
      state_(name_ + " has not been opened yet"),
      thread_([this] { keepOpen(stopping_, [this] { flow(); }); }) {}

SocketStream::~SocketStream() {
  stopping_ = true;
  thread_.join();
}

bool SocketStream::fails(const char* what, const std::string& why) {
  state_.fails({kind_ + "_" + what, why});
  return false;
}

void SocketStream::flow() {
  const auto opened = open_();
  if (!opened) return void(fails("absent", opened.error().detail));
  const Descriptor socket(*opened);
  const int on = 1;
  (void)::setsockopt(socket.get(), SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof on);
  heard_ns_ = HostClock::nowNs();
  bool silent = false;
  while (!stopping_) {
    pollfd wait{socket.get(), POLLIN, 0};
    const int ready = ::poll(&wait, 1, kPoll_ms);
    if (ready > 0 && !readOne(socket.get())) return;
    const bool now_silent = HostClock::nowNs() - heard_ns_ > silence_.count();
    if (now_silent && !silent) {
      fails("silent",
            fmt::format("{} is open and says nothing; is the sender on, and set to it?", name_));
      if (isStream(socket.get())) return;  // the other side may have vanished without closing
    }
    silent = now_silent;
  }
}

bool SocketStream::readOne(int socket) {
  std::array<std::uint8_t, 65536> bytes;
  alignas(cmsghdr) std::array<char, 256> control;
  iovec part{bytes.data(), bytes.size()};
  msghdr message{};
  message.msg_iov = &part;
  message.msg_iovlen = 1;
  message.msg_control = control.data();
  message.msg_controllen = control.size();
  const ssize_t got = ::recvmsg(socket, &message, MSG_DONTWAIT);
  if (got < 0) {
    if (errno == EAGAIN || errno == EINTR) return true;
    return fails("lost", fmt::format("{} cannot be read any more: {}; it is tried again", name_,
                                     std::strerror(errno)));
  }
  if (got == 0 && isStream(socket))
    return fails("lost", name_ + " was closed by the other side; it is tried again");
  const std::int64_t time_ns = arrivalOf(message);
  heard_ns_ = HostClock::nowNs();
  state_.flows(name_);
  give_({{bytes.data(), static_cast<std::size_t>(got)}, time_ns});
  return true;
}

void Lines::add(const Packet& packet,
                const std::function<void(std::string_view, std::int64_t)>& give) {
  for (const std::uint8_t byte : packet.bytes) {
    if (byte == '\n' || byte == '\r') {
      end(packet.time_ns, give);
    } else if (open_.size() <= kLongestLine) {
      open_ += static_cast<char>(byte);
    }
  }
}

void Lines::end(std::int64_t time_ns,
                const std::function<void(std::string_view, std::int64_t)>& give) {
  if (!open_.empty() && open_.size() <= kLongestLine) give(open_, time_ns);
  open_.clear();
}

}  // namespace perdure::capture
