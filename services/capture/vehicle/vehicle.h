// How fast the vehicle is, and where on Earth: from a CAN bus, lines of UDP, a receiver of
// satellites.
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
#include "services/capture/vehicle/nmea.h"
#include "services/capture/vehicle/socket_stream.h"
#include "services/capture/vehicle/wheel_speed.h"

namespace perdure::capture {

/// A line of UDP: "SPEED" or "SPEED SIGMA" in m/s, apart by blanks or a comma. Reason
/// "speed_malformed".
Result<SpeedReading> readSpeedLine(std::string_view line, double sigma, std::int64_t time_ns);

/// Throws StartupError where a signal or an address of the configuration is none.
void checkVehicle(const SpeedConfig& speed, const GnssConfig& gnss);

class Vehicle {
 public:
  struct Outputs {  // called on threads of this class, one at a time each
    std::function<void(const SpeedReading&)> speed;
    std::function<void(const EarthPlace&)> place;
  };
  /// Opens what the configuration names, and again whenever it is gone. Throws StartupError.
  Vehicle(const SpeedConfig& speed, const GnssConfig& gnss, Outputs outputs);
  /// With sockets of its caller's in place of those; a null one is not opened. For tests.
  Vehicle(const SpeedConfig& speed, const GnssConfig& gnss, Outputs outputs,
          OpenSocket speed_socket, OpenSocket gnss_socket);

  /// A sentence with the mend; empty where all that is configured flows.
  std::string problem() const;
  /// What gives, for people.
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
  NmeaReader speed_nmea_, gnss_nmea_;
  std::optional<SpeedReading> said_;  ///< the last of a datagram's lines
  EarthAnchor anchor_;
  std::atomic<bool> backwards_{false};
  std::atomic<std::int64_t> speed_ns_, fix_ns_;  ///< when there was one last, or the beginning
  mutable std::mutex mutex_;                     // of what follows
  std::optional<WheelSpeed> wheels_;
  ReasonCounts reasons_;
  std::string speed_trouble_, gnss_trouble_;
  // The threads of these use all of the above: they go first.
  std::unique_ptr<SocketStream> speed_stream_, gnss_stream_;
};

}  // namespace perdure::capture
