// Speed of the vehicle from wheel signals on a CAN bus.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "services/capture/vehicle/can_signal.h"

namespace perdure::capture {

struct SpeedReading {
  std::int64_t time_ns = 0;  ///< CLOCK_BOOTTIME
  double speed = 0.0;        ///< m/s along the body's x axis; negative backwards
  double sigma = 0.0;        ///< m/s, standard deviation
};

/// Returns the factor from a unit to m/s, for m/s, km/h, mph, kn and their usual synonyms. Fails
/// with "speed_unit" for other units.
Result<double> metresPerSecond(const std::string& unit);

struct WheelSettings {
  std::vector<CanSignal> wheels;     ///< at least one; the reading is their mean
  std::optional<CanSignal> reverse;  ///< indicates that the vehicle drives backwards
  double reverse_value = 1.0;        ///< physical value of `reverse` when driving backwards
  double sigma = 0.05;               ///< m/s, standard deviation of one wheel; its resolution
                                     ///< is added
};

/// Parses the texts of the configuration (config.h, `speed.can`). `reverse`: "ID LINE == VALUE", or
/// empty. Throws StartupError.
WheelSettings wheelSettings(const std::vector<std::string>& signals, const std::string& reverse,
                            double sigma);

/// Combines wheel signals into readings of the vehicle's speed. Single-threaded.
class WheelSpeed {
 public:
  explicit WheelSpeed(WheelSettings settings);

  /// Takes a frame of the bus. Returns a reading once each wheel has sent a value; its time is the
  /// mean of the values' times. If one wheel sends twice before another has sent, the reading uses
  /// only the wheels received, and "speed_can_partial" is counted. The variance of the mean
  /// includes `sigma`, the resolution and the differences between wheels. If `reverse` was not
  /// received for three seconds, "speed_can_no_reverse" is counted.
  std::optional<SpeedReading> frame(std::uint32_t id, bool extended,
                                    std::span<const std::uint8_t> data, std::int64_t time_ns);
  const ReasonCounts& reasons() const { return reasons_; }
  /// Returns why the last frame of a signal gave no value; empty if it gave one.
  const std::string& trouble() const { return trouble_; }

 private:
  struct Wheel {
    CanSignal signal;
    double to_mps;
    std::optional<double> speed;  ///< m/s, received since the last reading
    std::int64_t time_ns = 0;
  };
  bool take(Wheel& wheel, std::span<const std::uint8_t> data, std::int64_t time_ns);
  void hearReverse(std::uint32_t id, bool extended, std::span<const std::uint8_t> data,
                   std::int64_t time_ns);
  std::optional<SpeedReading> reading();

  const WheelSettings settings_;
  std::vector<Wheel> wheels_;
  bool backwards_ = false;
  std::int64_t reverse_ns_ = std::numeric_limits<std::int64_t>::min() / 2;  ///< time of the last
                                                                            ///< reverse signal
  ReasonCounts reasons_;
  std::string trouble_;
};

}  // namespace perdure::capture
