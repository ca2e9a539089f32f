// Estimates from loops the ratio of the true odometry error to the reported error. For poses
// without covariances the assumed random walk may be far too small or too large.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "common/mapping/parameters.h"

namespace perdure::mapping {

class DriftScale {
 public:
  explicit DriftScale(const DriftScaleParameters& parameters);

  /// Adds a loop that measured the error [δp, δyaw]. `measured`: covariance of the loop
  /// measurement; `odometry`: covariance of the error according to the odometry.
  void add(const Eigen::Vector4d& error, const Eigen::Matrix4d& measured,
           const Eigen::Matrix4d& odometry);

  /// The factor for covariances of the odometry. It is an upper quantile, because a factor that is
  /// too small leads to wrong associations.
  double variance() const;

 private:
  double quantile_;
  std::vector<double> log_scales_;  ///< grid over the scale of the standard deviation
  std::vector<double> log_posterior_;
};

}  // namespace perdure::mapping
