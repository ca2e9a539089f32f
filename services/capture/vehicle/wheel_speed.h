// The speed of the vehicle from the signals of its wheels on a CAN bus.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "services/capture/vehicle/can_signal.h"
#include "services/capture/vehicle/speed_reading.h"

namespace perdure::capture {

struct WheelSettings {
  std::vector<CanSignal> wheels;     ///< at least one; the reading is their mean
  std::optional<CanSignal> reverse;  ///< says whether the vehicle goes backwards
  double reverse_value = 1.0;        ///< physical, of `reverse` while it does
  double sigma = 0.05;               ///< m/s, of one wheel beside its resolution
};

/// Reads the texts of the configuration (config.h, `speed.can`). `reverse`: "ID LINE == VALUE", or
/// empty. Throws StartupError.
WheelSettings wheelSettings(const std::vector<std::string>& signals, const std::string& reverse,
                            double sigma);

/// Single-threaded.
class WheelSpeed {
 public:
  explicit WheelSpeed(WheelSettings settings);

  /// A frame of the bus. A reading comes once each wheel has spoken since the last one, at the mean
  /// of their times; of those that did, where one is heard twice before another
  /// ("speed_can_partial"). Its variance is that of the mean: of `sigma` and the resolution, and as
  /// the wheels differ. Where `reverse` has said nothing for three seconds it is counted,
  /// "speed_can_no_reverse".
  std::optional<SpeedReading> frame(std::uint32_t id, bool extended,
                                    std::span<const std::uint8_t> data, std::int64_t time_ns);
  const ReasonCounts& reasons() const { return reasons_; }
  /// Why the last frame of a signal gave nothing; empty where it did.
  const std::string& trouble() const { return trouble_; }

 private:
  struct Wheel {
    CanSignal signal;
    double to_mps;
    std::optional<double> speed;  ///< m/s, since the last reading
    std::int64_t time_ns = 0;
  };
  bool take(Wheel& wheel, std::span<const std::uint8_t> data, std::int64_t time_ns);
  void hearReverse(std::uint32_t id, bool extended, std::span<const std::uint8_t> data,
                   std::int64_t time_ns);
  std::optional<SpeedReading> reading();

  const WheelSettings settings_;
  std::vector<Wheel> wheels_;
  bool backwards_ = false;
  std::int64_t reverse_ns_ = std::numeric_limits<std::int64_t>::min() / 2;  ///< heard last
  ReasonCounts reasons_;
  std::string trouble_;
};

}  // namespace perdure::capture
