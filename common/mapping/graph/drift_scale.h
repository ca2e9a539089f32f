// Estimates from loops the ratio of the true odometry error to the reported error. For poses
// without covariances the assumed random walk may be far too small or too large.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "common/mapping/frames/anchor.h"
#include "common/mapping/parameters.h"

namespace perdure::mapping {

/// Place and yaw share one scale. Heights have their own: odometry without gravity errs in pitch,
/// so that its height drifts far more than its place.
class DriftScale {
 public:
  explicit DriftScale(const DriftScaleParameters& parameters);

  /// Adds a loop that measured the error [δp, δyaw]. `measured`: covariance of the loop
  /// measurement; `odometry`: covariance of the error according to the odometry.
  void add(const Eigen::Vector4d& error, const Eigen::Matrix4d& measured,
           const Eigen::Matrix4d& odometry);

  /// The factors for covariances of the odometry. They are upper quantiles, because factors that
  /// are too small lead to wrong associations.
  DriftVariance variance() const;

 private:
  using LogPosterior = std::vector<double>;  ///< over log_scales_
  double varianceOf(const LogPosterior& log_posterior) const;

  double quantile_;
  std::vector<double> log_scales_;  ///< grid over the scale of the standard deviation
  LogPosterior plane_, height_;
};

}  // namespace perdure::mapping
