// Reads a socket on its own thread, and reopens it after a loss.
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
  std::int64_t time_ns = 0;  ///< CLOCK_BOOTTIME; time of arrival, by the kernel if available
};

/// Opens a socket for reading. On failure, the detail is a sentence with the fix.
using OpenSocket = std::function<Result<int>()>;

/// Opens a raw CAN socket (SocketCAN) for classic and FD frames with these ids. A packet is the
/// kernel's `can_frame` or `canfd_frame`. An extended id has the kernel's flag CAN_EFF_FLAG.
OpenSocket canSocket(std::string interface, std::vector<std::uint32_t> ids);
OpenSocket udpSocket(std::string address);
/// Connects to HOST:PORT and sends `greeting` once. A packet is any piece of the received data.
OpenSocket tcpSocket(std::string address, std::string greeting);

class SocketStream {
 public:
  /// Starts the thread, on which `give` is called. `kind`: prefix of the reasons. With "speed"
  /// these are "speed_absent" (failed openings), "speed_lost" (reading failed) and "speed_silent"
  /// (no data for `silence`; a connection is then reopened). `name`: name of the source in
  /// messages.
  SocketStream(std::string kind, std::string name, std::chrono::nanoseconds silence,
               OpenSocket open, std::function<void(const Packet&)> give);
  ~SocketStream();
  SocketStream(const SocketStream&) = delete;
  SocketStream& operator=(const SocketStream&) = delete;

  const DeviceState& state() const { return state_; }

 private:
  void flow();
  /// Reads one packet. Returns false at the end of the stream, or if reading fails.
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

/// Splits packets into lines. Each complete line is returned once, without its end. A line of more
/// than 4096 bytes is dropped.
class Lines {
 public:
  void add(const Packet& packet, const std::function<void(std::string_view, std::int64_t)>& give);
  /// Ends the last line of a datagram, which may have no line end.
  void end(std::int64_t time_ns, const std::function<void(std::string_view, std::int64_t)>& give);

 private:
  std::string open_;
};

}  // namespace perdure::capture
