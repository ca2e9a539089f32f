// Computes trajectories on the ground: paths from corner points, and the speeds along them.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "common/sim/trajectory.h"

namespace perdure::sim {

struct Corner {
  Eigen::Vector2d point;
  double radius = 0.0;
};

struct PathPoint {
  Eigen::Vector2d position = Eigen::Vector2d::Zero();
  double heading = 0.0;    ///< radians, continuous along the path (not wrapped)
  double curvature = 0.0;  ///< 1/m, left turns positive
};

/// A path of straight lines and arcs with gradual changes of curvature. A closed path repeats; an
/// open path continues straight beyond its ends.
class GroundPath {
 public:
  GroundPath(const std::vector<Corner>& corners, bool closed, double smoothing_m = 4.0);

  double length() const { return step_ * static_cast<double>(segments()); }
  PathPoint at(double distance) const;

 private:
  std::size_t segments() const { return closed_ ? points_.size() : points_.size() - 1; }

  bool closed_;
  double step_ = 0.0;
  std::vector<PathPoint> points_;
};

struct SpeedLimits {
  double top = 8.0;         ///< m/s
  double lateral = 2.2;     ///< m/s², in curves
  double accelerate = 1.6;  ///< m/s²
  double brake = 1.8;       ///< m/s²
};

/// The distance along the path as a function of time.
struct Drive {
  double start_s = 0.0, interval_s = 0.05;
  std::vector<double> distance;  ///< distance along the path, one value per interval

  double distanceAt(double t_s) const;
};

/// Rests for `rest_s` at distance `from`, then drives as fast as the limits allow, until `until_s`
/// or until it stops at distance `to` (infinite: without a stop).
Drive drive(const GroundPath& path, const SpeedLimits& limits, double from, double to,
            double rest_s, double until_s);
/// Drives at constant speed from `from_s` to `until_s`, without a rest.
Drive cruise(double from, double speed, double from_s, double until_s);

struct Suspension {
  double height = 1.5;  ///< height of the body's origin above the ground
  double roll_per_accel = 0.009, pitch_per_accel = 0.006;  ///< rad per m/s²
  double bounce_m = 0.004, sway_rad = 0.0025;              ///< amplitudes on a rough road
  std::uint64_t seed = 0;                                  ///< seed of the road's roughness
  double lap_m = 0.0;  ///< period after which the road repeats; 0: never
};
Trajectory vehicleMotion(const GroundPath& path, const Drive& drive, const Suspension& suspension);
/// The motion of an object that stays upright.
Trajectory uprightMotion(const GroundPath& path, const Drive& drive, double height);

}  // namespace perdure::sim
