#include "common/earth/earth_place.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "common/earth/geodesy.h"
#include "common/math/so3.h"

namespace perdure {
namespace {

constexpr double kLongestGap_s = 1.0;  // longest gap between the poses before and after an anchor
constexpr double kFarEnough_m = 100.0;

}  // namespace

std::string earthAnchorOfMap(const GeoAnchor& anchor, const RigidTransform& T_MB) {
  const GeoReference onEarth(anchor, T_MB);
  const Geodetic origin = onEarth(Eigen::Vector3d::Zero());
  // The direction of east differs between places, so the yaw is computed at M's origin.
  const Eigen::Vector3d ahead = toEcef(onEarth(kFarEnough_m * Eigen::Vector3d::UnitX()));
  const Eigen::Vector3d x = enuAxes(origin).transpose() * (ahead - toEcef(origin));
  return fmt::format("{:.10f} {:.10f} {:.4f} {:.6f}", origin.latitude_deg, origin.longitude_deg,
                     origin.height_m, std::atan2(x.y(), x.x()) * 180.0 / std::numbers::pi);
}

void EarthPlace::onCalibration(const Calibration& calibration) {
  if (!calibration.anchor || heard_ == calibration.anchor->time) return;
  heard_ = calibration.anchor->time;
  awaited_ = calibration.anchor;
}

void EarthPlace::onOdometry(const Odometry& odometry) {
  if (odometry.state == OdometryState::kInitialising) return last_.reset();
  const Pose now{odometry.stamp.time, odometry.world, odometry.T_WB};
  if (awaited_ && now.time >= awaited_->time) {
    const bool around = last_ && last_->world == now.world && last_->time <= awaited_->time &&
                        toSeconds(now.time - last_->time) <= kLongestGap_s;
    const double length = around ? toSeconds(now.time - last_->time) : 0.0;
    if (now.time == awaited_->time) {
      known_ = Known{*awaited_, now};
    } else if (around) {
      const double share = toSeconds(awaited_->time - last_->time) / length;
      known_ =
          Known{*awaited_, {awaited_->time, now.world, interpolate(last_->T_WB, now.T_WB, share)}};
    }
    awaited_.reset();
  }
  last_ = now;
}

std::optional<TimePoint> EarthPlace::known() const {
  return known_ ? std::optional(known_->pose.time) : std::nullopt;
}

std::optional<double> EarthPlace::yawOf(const WorldId& world) const {
  if (!known_ || known_->pose.world != world) return std::nullopt;
  return known_->anchor.yaw - perdure::yawOf(known_->pose.T_WB.R());
}

std::optional<std::string> EarthPlace::ofMap(const WorldId& world, const FrameAt& T_MW) const {
  if (!known_ || known_->pose.world != world) return std::nullopt;
  const auto frame = T_MW(known_->pose.time);
  if (!frame) return std::nullopt;
  return earthAnchorOfMap(known_->anchor, *frame * known_->pose.T_WB);
}

}  // namespace perdure
