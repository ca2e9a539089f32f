// `perdure-capture --list`: the cameras and inertial units that are here, with what they can do,
// and a configuration to paste.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace perdure::capture {

struct SeenCamera {
  std::string id, model;
  struct Mode {
    std::string format;
    std::vector<std::pair<std::uint32_t, std::uint32_t>> sizes;  ///< width, height; rising
  };
  std::vector<Mode> modes;
  double slowest_hz = 0.0, fastest_hz = 0.0;  ///< 0: it does not say
  std::vector<std::string> settable;          ///< keys of the configuration
};

struct SeenImu {
  std::string id, name;
  bool gyro = false, accel = false;
  std::string rates;  ///< as the device says them; empty: it does not
  double rate_hz = 0.0;
  std::vector<std::string> triggers;  ///< of the context
};

struct Seen {
  std::vector<SeenCamera> cameras;
  std::vector<SeenImu> imus;
  std::vector<std::string> problems;  ///< why something could not be looked at, with the mend
};

/// Looks at libcamera and at the context `uri` of libiio.
Seen lookAround(const std::string& uri);

/// For people: what is there, or what was looked for and is not; and a configuration of the first
/// camera, or the first two, and the first unit that has both.
std::string describe(const Seen& seen, const std::string& uri);

/// The whole of `perdure-capture --list [URI]`; 69 where there is nothing. Prints.
int listSensors(const std::vector<std::string>& arguments);

}  // namespace perdure::capture
