// Receives the vehicle's speed and position on Earth, from a CAN bus, UDP lines or gpsd.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>

#include "services/capture/config.h"
#include "services/capture/vehicle/earth_anchor.h"
#include "services/capture/vehicle/socket_stream.h"
#include "services/capture/vehicle/wheel_speed.h"

namespace perdure::capture {

/// Parses a UDP line: "SPEED" or "SPEED SIGMA" in m/s, separated by blanks or a comma. Fails with
/// "speed_malformed".
Result<SpeedReading> readSpeedLine(std::string_view line, double sigma, std::int64_t time_ns);

/// Throws StartupError if the configuration has an invalid signal or address.
void checkVehicle(const SpeedConfig& speed, const GnssConfig& gnss);

class Vehicle {
 public:
  struct Outputs {  // callbacks on threads of this class; each by one thread at a time
    std::function<void(const SpeedReading&)> speed;
    std::function<void(const EarthPlace&)> place;
  };
  /// Opens the configured sources, and reopens them after a loss. Throws StartupError.
  Vehicle(const SpeedConfig& speed, const GnssConfig& gnss, Outputs outputs);
  /// For tests: uses these sockets instead. An empty function opens no socket.
  Vehicle(const SpeedConfig& speed, const GnssConfig& gnss, Outputs outputs,
          OpenSocket speed_socket, OpenSocket gnss_socket);

  /// Returns the problem as a sentence with the fix; empty while all configured sources send data.
  std::string problem() const;
  std::string name() const;
  void report(ReasonCounts& counts) const;

 private:
  void onCan(const Packet& packet);
  void onSpeedLine(std::string_view line, std::int64_t time_ns);
  void onGnssLine(std::string_view line, std::int64_t time_ns);
  void give(SpeedReading reading);
  void take(GnssFix fix);
  enum class Of : std::uint8_t { kSpeed, kPlace };
  void count(Of what, const Reason& reason);
  std::string silence() const;

  const SpeedConfig speed_;
  const GnssConfig gnss_;
  const Outputs outputs_;
  Lines speed_lines_, gnss_lines_;
  std::optional<SpeedReading> said_;  ///< last reading from the lines of a datagram
  EarthAnchor anchor_;
  std::atomic<bool> backwards_{false};
  std::atomic<std::int64_t> speed_ns_, fix_ns_;  ///< initially the start
  mutable std::mutex mutex_;                     // protects the members below
  std::optional<WheelSpeed> wheels_;
  ReasonCounts reasons_;
  std::string speed_trouble_, gnss_trouble_;
  // The threads of these members use all members above, so these members are destroyed first.
  std::unique_ptr<SocketStream> speed_stream_, gnss_stream_;
};

}  // namespace perdure::capture
