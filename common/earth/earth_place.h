// Computes the position of the map on Earth from that of a satellite receiver and the body's pose.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "common/math/rigid_transform.h"
#include "common/types/odometry.h"
#include "common/types/sensors.h"

namespace perdure {

/// Returns "LATITUDE LONGITUDE HEIGHT YAW" of M's origin: degrees (WGS 84), metres above the
/// ellipsoid, and yaw of M's x axis from east in degrees, as for `perdure map export --anchor` and
/// `store.earth_anchor`. `T_MB` is the body's pose at the anchor's time.
std::string earthAnchorOfMap(const GeoAnchor& anchor, const RigidTransform& T_MB);

/// Finds the body's pose at the time of the newest anchor of the calibration. Not thread-safe.
class EarthPlace {
 public:
  /// Returns the present T_MW near the body's place at a time; nothing if W is not yet located in
  /// the map's M.
  using FrameAt = std::function<std::optional<RigidTransform>(TimePoint)>;

  /// Call it for each calibration. If its anchor is new, the next poses are used for it.
  void onCalibration(const Calibration& calibration);
  void onOdometry(const Odometry& odometry);
  /// The time of the newest anchor whose pose is known; nothing if there is none.
  std::optional<TimePoint> known() const;
  /// Returns the yaw of the x axis of W from east, in rad; nothing if it is not known for `world`.
  std::optional<double> yawOf(const WorldId& world) const;
  /// Returns earthAnchorOfMap() of that anchor; nothing if its pose is not in `world`, or if `T_MW`
  /// returns nothing.
  std::optional<std::string> ofMap(const WorldId& world, const FrameAt& T_MW) const;

 private:
  struct Pose {
    TimePoint time;
    WorldId world;
    RigidTransform T_WB;
  };
  struct Known {
    GeoAnchor anchor;
    Pose pose;
  };
  std::optional<GeoAnchor> awaited_;
  std::optional<TimePoint> heard_;  ///< time of the last received anchor
  std::optional<Pose> last_;
  std::optional<Known> known_;
};

}  // namespace perdure
