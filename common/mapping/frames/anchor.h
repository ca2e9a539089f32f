// An anchor is a place on the trajectory of the body. Objects are stored relative to an anchor.
// When the graph moves anchors, objects move with them.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>

#include "common/base/ids.h"
#include "common/mapping/frames/level_pose.h"

namespace perdure::mapping {

using AnchorId = std::uint64_t;  ///< 0: none; ids increase with time within a session

/// Factors of the odometry's covariances: `plane` for x, y and yaw, `height` for z. of() applies
/// them to a covariance of [p, yaw]; over() divides them by other factors.
struct DriftVariance {
  double plane = 1.0, height = 1.0;
  Eigen::Matrix4d of(const Eigen::Matrix4d& covariance) const {
    const double p = std::sqrt(plane);
    const Eigen::Vector4d s(p, p, std::sqrt(height), p);
    return s.asDiagonal() * covariance * s.asDiagonal();
  }
  DriftVariance over(const DriftVariance& other) const {
    return {plane / other.plane, height / other.height};
  }
  bool operator==(const DriftVariance&) const = default;
};

struct Anchor {
  AnchorId id = 0;
  AnchorId previous = 0;  ///< previous anchor of the same session; 0: the first one
  WorldId session;        ///< the odometry's frame of reference W
  FrameStamp stamp;
  RigidTransform T_WA;          ///< z against gravity; constant
  LevelGaussian from_previous;  ///< T_previous,A by odometry, with `scale` applied
  double way_m = 0.0;           ///< distance travelled in the session so far
  DriftVariance scale;          ///< factors, estimated from loops, of the increment's covariance
};

}  // namespace perdure::mapping
