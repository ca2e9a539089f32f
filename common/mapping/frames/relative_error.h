// The odometry error since an earlier place: the present pose error minus the error at that place,
// which the rigid motion of the body has propagated. Derivation: tools/docs/maths/pose_graph.md.
#pragma once

#include <Eigen/Core>

#include "common/types/odometry.h"

namespace perdure::mapping {

/// Assumed random walk of the error over the distance travelled, for poses without increments.
struct LevelWalk {
  double position = 0.0;  ///< m/√m
  double yaw = 0.0;       ///< rad/√m
};

class RelativeError {
 public:
  explicit RelativeError(const LevelWalk& walk) : walk_(walk) {}

  /// Sets the earlier place to the pose of `odometry`.
  void begin(const Odometry& odometry);
  /// Continues from the odometry `before` to `now`; `metres` is the distance travelled between
  /// them.
  void add(const Odometry& before, const Odometry& now, double metres);

  /// The covariance of the relative error [δp, δyaw], m and rad, δp in W.
  Eigen::Matrix4d covariance() const { return joint_.topLeftCorner<4, 4>(); }

 private:
  LevelWalk walk_;
  /// Covariance of the relative error (4) and of the pose error [θ, p] (6).
  Eigen::Matrix<double, 10, 10> joint_ = Eigen::Matrix<double, 10, 10>::Zero();
};

}  // namespace perdure::mapping
