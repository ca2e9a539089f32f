// Implements `perdure-capture --list`, which prints the connected cameras and inertial units, and a
// configuration for them.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace perdure::capture {

struct SeenCamera {
  std::string id, model;
  struct Mode {
    std::string format;
    std::vector<std::pair<std::uint32_t, std::uint32_t>> sizes;  ///< width, height; in rising order
  };
  std::vector<Mode> modes;
  double slowest_hz = 0.0, fastest_hz = 0.0;  ///< 0: not reported
  std::vector<std::string> settable;          ///< configuration keys that the camera supports
};

struct SeenImu {
  std::string id, name;
  bool gyro = false, accel = false;
  std::string rates;  ///< as reported by the device; empty: not reported
  double rate_hz = 0.0;
  std::vector<std::string> triggers;  ///< names of the triggers in the libiio context
};

struct Seen {
  std::vector<SeenCamera> cameras;
  std::vector<SeenImu> imus;
  std::vector<std::string> problems;  ///< devices that could not be read: cause and fix
};

/// Finds cameras through libcamera, and inertial units through the libiio context `uri`.
Seen lookAround(const std::string& uri);

/// Returns text: the devices found (or where they were searched), and a configuration to copy.
std::string describe(const Seen& seen, const std::string& uri);

/// Runs `perdure-capture --list [URI]`, prints the result, and returns the exit status: 69 if no
/// device is found.
int listSensors(const std::vector<std::string>& arguments);

}  // namespace perdure::capture
