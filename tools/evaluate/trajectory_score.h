// How far a trajectory is from truth: ATE after alignment, RPE, and KITTI's segment errors.
// Source: Zhang and Scaramuzza, "A Tutorial on Quantitative Trajectory Evaluation" (IROS 2018);
// Geiger et al., "Are we ready for autonomous driving?" (CVPR 2012) for t_err and r_err.
#pragma once

#include <optional>
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
  kStart,  ///< position and yaw, of the first pose alone
};

/// T_GE with T_GE · estimate ≈ truth in the least-squares sense of positions, or of the first pair
/// alone. At least one pair.
RigidTransform align(const std::vector<PosePair>& pairs, Alignment alignment);

struct SegmentError {
  std::vector<double> lengths_m;  ///< that were tried: 100–800 m, shorter where the drive is
  std::size_t segments = 0;
  double t_err_percent = 0.0, r_err_deg_per_m = 0.0;
};

struct TrajectoryScore {
  std::size_t poses = 0;
  double length_m = 0.0;                     ///< of the truth
  double ate_rmse_m = 0.0, ate_max_m = 0.0;  ///< after alignment
  double ate_rotation_deg = 0.0;             ///< RMSE after alignment
  double rpe_m = 0.0, rpe_deg = 0.0;         ///< RMSE over one second
  double end_drift_m = 0.0;  ///< of the last pose, when the first ones are laid on each other
  SegmentError segments;
};

/// At least two pairs, by time.
TrajectoryScore scoreTrajectory(const std::vector<PosePair>& pairs, Alignment alignment);

}  // namespace perdure::tools
