// Selects the fixes of a GNSS receiver that give the vehicle's position and heading on Earth.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <deque>
#include <optional>

#include "services/capture/vehicle/gpsd.h"

namespace perdure::capture {

struct AnchorSettings {
  double most_sigma_m = 5.0;                          ///< largest accepted sigma_m of a fix
  Eigen::Vector3d antenna = Eigen::Vector3d::Zero();  ///< position in the body, m
};

/// The position of the body's origin, in degrees and metres as in GnssFix, and the body's yaw.
struct EarthPlace {
  std::int64_t time_ns = 0;  ///< CLOCK_BOOTTIME
  double latitude_deg = 0, longitude_deg = 0, height_m = 0;
  double yaw = 0;      ///< yaw of the body's x axis: radians from east, counter-clockwise
  double sigma_m = 0;  ///< standard deviation of each horizontal axis
};

/// Combines fixes into a position with a heading, which is the course over ground of a straight
/// drive: fixes over two seconds, faster than 2 m/s, with courses within 2°. While the vehicle
/// drives backwards, there is no heading. Single-threaded.
class EarthAnchor {
 public:
  explicit EarthAnchor(AnchorSettings settings) : settings_(settings) {}

  /// Takes a fix. Returns the first position, and later ones whose sigma is at most half the
  /// smallest sigma returned before, or similar to it after half a minute. `backwards`: the wheels
  /// report that the vehicle drives backwards.
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
