// How far the odometry may be off since a place that the body has passed: the error of its pose
// now, less the error then, which the body carries on rigidly.
// Derivation: tools/docs/maths/pose_graph.md.
#pragma once

#include <Eigen/Core>

#include "common/types/odometry.h"

namespace perdure::mapping {

/// A random walk by distance, for poses that come without increments.
struct LevelWalk {
  double position = 0.0;  ///< m/√m
  double yaw = 0.0;       ///< rad/√m
};

class RelativeError {
 public:
  explicit RelativeError(const LevelWalk& walk) : walk_(walk) {}

  /// The place is that of `odometry`.
  void begin(const Odometry& odometry);
  /// Goes on from the frame `before` to the frame `now`, `metres` of way apart.
  void add(const Odometry& before, const Odometry& now, double metres);

  /// Of [δp, δyaw], p in W.
  Eigen::Matrix4d covariance() const { return joint_.topLeftCorner<4, 4>(); }

 private:
  LevelWalk walk_;
  /// Of the relative error (4) and of the pose error [θ, p] (6).
  Eigen::Matrix<double, 10, 10> joint_ = Eigen::Matrix<double, 10, 10>::Zero();
};

}  // namespace perdure::mapping
