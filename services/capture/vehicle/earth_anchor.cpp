#include "services/capture/vehicle/earth_anchor.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/earth/geodesy.h"

namespace perdure::capture {
namespace {

constexpr double kSlowest = 2.0;  // m/s; an error of 0.05 m/s is then 1.5° of course
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
  // Returns a position again, because readers may have had no pose at the time of the previous one.
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
  return std::ranges::all_of(
      drive_, [&](const GnssFix& fix) { return std::abs(turnedBy(now, *fix.course)) <= kBend; });
}

EarthPlace EarthAnchor::placeOf(const GnssFix& fix, double yaw) const {
  const GeoAnchor antenna{{}, fix.latitude_deg, fix.longitude_deg, fix.height_m, yaw};
  const RigidTransform at(Eigen::Quaterniond::Identity(), settings_.antenna);
  const Geodetic body = GeoReference(antenna, at)(Eigen::Vector3d::Zero());
  return {fix.time_ns, body.latitude_deg, body.longitude_deg, body.height_m, yaw, fix.sigma_m};
}

}  // namespace perdure::capture
