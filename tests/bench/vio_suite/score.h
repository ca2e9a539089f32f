// Scores a trajectory with covariances against the truth.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "common/replay/files/pose_file.h"
#include "common/types/odometry.h"
#include "services/vio/core/update/point_updates.h"

namespace perdure::bench {

inline constexpr std::array<double, 4> kDistances{2.0, 5.0, 10.0, 50.0};  ///< m

/// Squared normalised errors per dimension at one time. W is aligned with the truth by position and
/// yaw at the first output.
struct NeesAt {
  double seconds = 0.0;  ///< time since the first output
  double position = 0.0, yaw = 0.0, velocity = 0.0;
  double position_error = 0.0, yaw_error = 0.0;  ///< m, rad
};

struct Accuracy {
  std::size_t poses = 0;
  double length_m = 0.0;
  double ate_m = 0.0;  ///< rms, after alignment of position and yaw
  double scale = 1.0;  ///< the scale of the estimate that fits the truth best
  /// rms error over each of kDistances, as a share of the distance; empty if the clip is shorter.
  std::array<std::optional<double>, kDistances.size()> relative;
  std::vector<NeesAt> nees;    ///< one sample every ten seconds
  int in_band = 0, asked = 0;  ///< number of samples, and number in the 95 % band of one sample
};

/// Scores the usable outputs of one world, in order of time.
Accuracy accuracyOf(const std::vector<Odometry>& odometry, const replay::PoseFile& truth,
                    double time_offset_s);

/// Score of a start. `odometry` begins at the first output, where W is aligned with the truth by
/// position and yaw.
struct StartJudgement {
  double scale = 0.0, way_m = 0.0;
  double error_m = 0.0, deviations = 0.0;             ///< error of the last position, in m and in
                                                      ///< standard deviations
  NeesAt nees;                                        ///< errors of the last output
  double velocity_error = 0.0, velocity_sigma = 0.0;  ///< errors of the first output, m/s
};
StartJudgement judgeStart(const std::vector<Odometry>& odometry, const replay::PoseFile& truth);

/// Statistics of the innovations of images over a run.
class Innovations {
 public:
  void add(const std::vector<vio::Innovation>& frame);
  /// Mean of rᵀ S⁻¹ r per row: 1 if noise and covariance are right.
  double size() const { return rows_ > 0 ? nis_ / rows_ : 0.0; }
  /// Correlation of a frame's median residual with that of the previous frame: 0 if it is white.
  double whiteness() const { return power_ > 0 ? product_ / power_ : 0.0; }
  double used() const { return count_ > 0 ? used_ / count_ : 0.0; }

 private:
  double nis_ = 0, rows_ = 0, used_ = 0, count_ = 0, product_ = 0, power_ = 0;
  std::optional<Eigen::Vector2d> before_;
};

}  // namespace perdure::bench
