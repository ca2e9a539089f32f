// Chooses, of the fixes of a receiver, the one that says where on Earth the vehicle stood.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <deque>
#include <optional>

#include "services/capture/vehicle/gnss_fix.h"

namespace perdure::capture {

struct AnchorSettings {
  double most_sigma_m = 5.0;                          ///< a fix that states more is not used
  Eigen::Vector3d antenna = Eigen::Vector3d::Zero();  ///< in the body, metres
};

/// Where the origin of the body was, in degrees and metres as GnssFix, and its yaw.
struct EarthPlace {
  std::int64_t time_ns = 0;  ///< CLOCK_BOOTTIME
  double latitude_deg = 0, longitude_deg = 0, height_m = 0;
  double yaw = 0;      ///< of the body's x axis: radians from east, counter-clockwise
  double sigma_m = 0;  ///< one deviation of each horizontal axis
};

/// A place with a heading. Its heading is the course over ground of a drive that is straight: of
/// fixes over two seconds, faster than 2 m/s, whose courses differ by no more than 2°. A vehicle
/// that goes backwards has none. Single-threaded.
class EarthAnchor {
 public:
  explicit EarthAnchor(AnchorSettings settings) : settings_(settings) {}

  /// A place where the fix gives the first one, one at most half as uncertain as the best that was
  /// given, or after half a minute one that is about as good. `backwards`: as the wheels say.
  std::optional<EarthPlace> offer(const GnssFix& fix, bool backwards);

 private:
  bool straight() const;
  EarthPlace placeOf(const GnssFix& fix, double yaw) const;

  const AnchorSettings settings_;
  std::deque<GnssFix> drive_;
  std::optional<double> given_sigma_m_;  ///< the least
  std::int64_t given_ns_ = 0;            ///< the last
};

}  // namespace perdure::capture
