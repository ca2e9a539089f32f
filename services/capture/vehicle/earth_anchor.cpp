#include "services/capture/vehicle/earth_anchor.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace perdure::capture {
namespace {

constexpr double kSlowest = 2.0;  // m/s: a course at .05 m/s of error is then right to 1.5°
constexpr double kBend = 2.0 * std::numbers::pi / 180.0;
constexpr std::int64_t kDrive_ns = 2'000'000'000, kGap_ns = 1'500'000'000;
constexpr std::size_t kFewest = 3;
constexpr std::int64_t kAgain_ns = 30'000'000'000;
constexpr double kBetter = 0.5, kAsGood = 1.2;

double turnedBy(double from, double to) {
  return std::remainder(to - from, 2.0 * std::numbers::pi);
}

}  // namespace

std::optional<EarthPlace> EarthAnchor::offer(const GnssFix& fix, bool backwards) {
  const bool moves = fix.speed && fix.course && *fix.speed >= kSlowest && !backwards;
  if (!moves || (!drive_.empty() && (fix.time_ns - drive_.back().time_ns > kGap_ns ||
                                     fix.time_ns <= drive_.back().time_ns))) {
    drive_.clear();
  }
  if (!moves) return std::nullopt;
  drive_.push_back(fix);
  while (drive_.size() > 1 && fix.time_ns - drive_[1].time_ns >= kDrive_ns) drive_.pop_front();
  // Who listens may not have had a pose at the time of the last one.
  const bool again = given_sigma_m_ && fix.time_ns - given_ns_ >= kAgain_ns &&
                     fix.sigma_m <= kAsGood * *given_sigma_m_;
  const bool better = !given_sigma_m_ || fix.sigma_m <= kBetter * *given_sigma_m_ || again;
  if (!(fix.sigma_m <= settings_.most_sigma_m) || !better || !straight()) return std::nullopt;
  given_sigma_m_ = std::min(fix.sigma_m, given_sigma_m_.value_or(fix.sigma_m));
  given_ns_ = fix.time_ns;
  return placeOf(fix, *fix.course);
}

bool EarthAnchor::straight() const {
  if (drive_.size() < kFewest || drive_.back().time_ns - drive_.front().time_ns < kDrive_ns) {
    return false;
  }
  const double now = *drive_.back().course;
  return std::all_of(drive_.begin(), drive_.end(), [&](const GnssFix& fix) {
    return std::abs(turnedBy(now, *fix.course)) <= kBend;
  });
}

/// The origin of the body, by the ellipsoid's radii of curvature at the antenna.
EarthPlace EarthAnchor::placeOf(const GnssFix& fix, double yaw) const {
  constexpr double kA = 6378137.0, kE2 = 6.69437999014e-3, kDegree = std::numbers::pi / 180.0;
  const double latitude = fix.latitude_deg * kDegree, s = std::sin(latitude);
  const double w = std::sqrt(1.0 - kE2 * s * s);
  const double meridian = kA * (1.0 - kE2) / (w * w * w), normal = kA / w;
  const Eigen::Vector3d& a = settings_.antenna;
  const double east = std::cos(yaw) * a.x() - std::sin(yaw) * a.y();
  const double north = std::sin(yaw) * a.x() + std::cos(yaw) * a.y();
  EarthPlace place;
  place.time_ns = fix.time_ns;
  place.latitude_deg = fix.latitude_deg - north / (meridian + fix.height_m) / kDegree;
  place.longitude_deg =
      fix.longitude_deg - east / ((normal + fix.height_m) * std::cos(latitude)) / kDegree;
  place.height_m = fix.height_m - a.z();
  place.yaw = yaw;
  place.sigma_m = fix.sigma_m;
  return place;
}

}  // namespace perdure::capture
