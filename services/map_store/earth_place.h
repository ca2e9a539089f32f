// The position of the map on Earth, from a satellite receiver and the body's pose.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "common/math/rigid_transform.h"
#include "common/types/odometry.h"
#include "common/types/sensors.h"

namespace perdure::map_store {

/// "LATITUDE LONGITUDE HEIGHT YAW" of M's origin: degrees of WGS 84, metres above the ellipsoid,
/// and degrees of M's x axis from east. `perdure map export --anchor` and `store.earth_anchor` use
/// the same format. `T_MB`: the body's pose at the anchor's time.
std::string earthAnchorOfMap(const GeoAnchor& anchor, const RigidTransform& T_MB);

/// Waits for the pose at the time of the newest anchor. Not thread-safe.
class EarthPlace {
 public:
  /// The pose of W in M at a time of the body, by today's graph; nothing if W is not yet located in
  /// the map's M.
  using FrameAt = std::function<std::optional<RigidTransform>(TimePoint)>;

  /// Call it for each calibration. A new anchor restarts the wait.
  void onCalibration(const Calibration& calibration);
  void onOdometry(const Odometry& odometry);
  /// The time of the newest anchor whose pose is known.
  std::optional<TimePoint> known() const;
  /// earthAnchorOfMap() of that anchor if its pose is in `world`; else nothing.
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
  std::optional<TimePoint> heard_;  ///< time of the last anchor
  std::optional<Pose> last_;
  std::optional<Known> known_;
};

}  // namespace perdure::map_store
