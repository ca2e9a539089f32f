// Selects the fix of a GNSS receiver that gives the vehicle's position on Earth.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <deque>
#include <optional>

#include "services/capture/vehicle/gpsd.h"

namespace perdure::capture {

struct AnchorSettings {
  double most_sigma_m = 5.0;                          ///< largest accepted sigma of a fix
  Eigen::Vector3d antenna = Eigen::Vector3d::Zero();  ///< position in the body, m
};

/// Position of the body's origin, in degrees and metres as in GnssFix, and its yaw.
struct EarthPlace {
  std::int64_t time_ns = 0;  ///< CLOCK_BOOTTIME
  double latitude_deg = 0, longitude_deg = 0, height_m = 0;
  double yaw = 0;      ///< yaw of the body's x axis: radians from east, counter-clockwise
  double sigma_m = 0;  ///< standard deviation of each horizontal axis
};

/// Position with a heading. The heading is the course over ground on a straight drive. This needs
/// fixes over two seconds, faster than 2 m/s, with courses within 2°. A vehicle that drives
/// backwards has no heading. Single-threaded.
class EarthAnchor {
 public:
  explicit EarthAnchor(AnchorSettings settings) : settings_(settings) {}

  /// Returns the first position, and later positions whose sigma is at most half the best sigma
  /// returned. After half a minute, it also returns a position with a similar sigma. `backwards`:
  /// from the wheels.
  std::optional<EarthPlace> offer(const GnssFix& fix, bool backwards);

 private:
  bool straight() const;
  EarthPlace placeOf(const GnssFix& fix, double yaw) const;

  const AnchorSettings settings_;
  std::deque<GnssFix> drive_;
  std::optional<double> given_sigma_m_;  ///< smallest sigma returned
  std::int64_t given_ns_ = 0;            ///< time of the last position returned
};

}  // namespace perdure::capture
