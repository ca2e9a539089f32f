// Trajectory errors: ATE after alignment and RPE (Zhang and Scaramuzza, IROS 2018), and KITTI's
// t_err and r_err (Geiger et al., CVPR 2012).
#pragma once

#include <vector>

#include "common/base/time.h"
#include "common/math/rigid_transform.h"

namespace perdure::tools {

struct PosePair {
  TimePoint time;
  RigidTransform estimate, truth;  ///< T_WB, each in its own W
};

enum class Alignment {
  kYaw,    ///< position and yaw
  kRigid,  ///< position and rotation
  kStart,  ///< position and yaw of the first pose only
};

/// Returns T_GE with T_GE · estimate ≈ truth, by least squares of positions; for kStart, from the
/// first pair only. Needs at least one pair.
RigidTransform align(const std::vector<PosePair>& pairs, Alignment alignment);

struct SegmentError {
  std::vector<double> lengths_m;  ///< segment lengths: 100–800 m, or less for a short drive
  std::size_t segments = 0;
  double t_err_percent = 0.0, r_err_deg_per_m = 0.0;
};

struct TrajectoryScore {
  std::size_t poses = 0;
  double length_m = 0.0;                     ///< length of the ground truth
  double ate_rmse_m = 0.0, ate_max_m = 0.0;  ///< ATE after alignment
  double ate_rotation_deg = 0.0;             ///< RMSE after alignment
  double rpe_m = 0.0, rpe_deg = 0.0;         ///< RMSE over one second
  double end_drift_m = 0.0;  ///< error of the last pose, after alignment of the first ones
  SegmentError segments;
};

/// Needs at least two pairs, sorted by time.
TrajectoryScore scoreTrajectory(const std::vector<PosePair>& pairs, Alignment alignment);

}  // namespace perdure::tools
