// Where on Earth the map lies: of a place that a receiver of satellites gave, and of the pose
// there.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "common/math/rigid_transform.h"
#include "common/types/odometry.h"
#include "common/types/sensors.h"

namespace perdure::map_store {

/// "LATITUDE LONGITUDE HEIGHT YAW" of M's origin: degrees of WGS 84, metres over the ellipsoid, and
/// degrees of its x axis from east, as `perdure map export --anchor` and `store.earth_anchor` have
/// them. `T_MB`: where the body was at the anchor's time.
std::string earthAnchorOfMap(const GeoAnchor& anchor, const RigidTransform& T_MB);

/// Waits for the pose at the time of the newest anchor. Single-threaded.
class EarthPlace {
 public:
  /// How W lay in M when the body was at a time of it, as is known today; nothing: it does not lie
  /// in the map's M yet.
  using FrameAt = std::function<std::optional<RigidTransform>(TimePoint)>;

  /// Of each calibration; one with another anchor than the last begins the wait.
  void onCalibration(const Calibration& calibration);
  void onOdometry(const Odometry& odometry);
  /// The time of the newest anchor that a pose is known of.
  std::optional<TimePoint> known() const;
  /// earthAnchorOfMap() of that anchor, where its pose is of `world`; else nothing.
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
  std::optional<TimePoint> heard_;  ///< of the last anchor
  std::optional<Pose> last_;
  std::optional<Known> known_;
};

}  // namespace perdure::map_store
