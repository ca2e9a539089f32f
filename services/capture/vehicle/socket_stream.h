// What a socket says, read on a thread of its own, and opened again when it was gone.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <thread>

#include "common/base/result.h"
#include "services/capture/live/device_state.h"

namespace perdure::capture {

struct Packet {
  std::span<const std::uint8_t> bytes;
  std::int64_t time_ns = 0;  ///< CLOCK_BOOTTIME; the kernel's time of arrival where it tells it
};

/// A socket to read. The detail of a failure is a sentence with the mend; its code is not used.
using OpenSocket = std::function<Result<int>()>;

/// Raw frames of these ids of a CAN interface (SocketCAN), classic and FD: a packet is the kernel's
/// `can_frame` or `canfd_frame`. An extended id has the kernel's flag CAN_EFF_FLAG.
OpenSocket canSocket(std::string interface, std::vector<std::uint32_t> ids);
/// Datagrams that come to HOST:PORT.
OpenSocket udpSocket(std::string address);
/// A connection to HOST:PORT; `greeting` is sent once. A packet is any piece of what comes.
OpenSocket tcpSocket(std::string address, std::string greeting);

class SocketStream {
 public:
  /// `kind`: begins its reasons, as "speed": "speed_absent" (a try to open it), "speed_lost" (it
  /// could be read, and no longer), "speed_silent" (open, and nothing for `silence`; a connection
  /// is then opened anew). `name`: for people. `give` is called on the stream's thread.
  SocketStream(std::string kind, std::string name, std::chrono::nanoseconds silence,
               OpenSocket open, std::function<void(const Packet&)> give);
  ~SocketStream();
  SocketStream(const SocketStream&) = delete;
  SocketStream& operator=(const SocketStream&) = delete;

  const DeviceState& state() const { return state_; }

 private:
  void flow();
  /// False where the socket is at its end.
  bool readOne(int socket);
  bool fails(const char* what, const std::string& why);

  const std::string kind_, name_;
  const std::chrono::nanoseconds silence_;
  const OpenSocket open_;
  const std::function<void(const Packet&)> give_;
  std::atomic<bool> stopping_{false};
  std::int64_t heard_ns_ = 0;
  DeviceState state_;
  std::thread thread_;
};

/// Lines of packets: each whole one once, without its end. A line of more than 4096 bytes is none.
class Lines {
 public:
  void add(const Packet& packet, const std::function<void(std::string_view, std::int64_t)>& give);
  /// Of datagrams, each of which ends its last line.
  void end(std::int64_t time_ns, const std::function<void(std::string_view, std::int64_t)>& give);

 private:
  std::string open_;
};

}  // namespace perdure::capture
