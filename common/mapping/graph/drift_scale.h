// How large the error of the odometry is compared with what it says, as loops show it. Poses that
// come without covariances say nothing; what they are assumed to walk by may be wrong by far, to
// either side.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "common/mapping/parameters.h"

namespace perdure::mapping {

class DriftScale {
 public:
  explicit DriftScale(const DriftScaleParameters& parameters);

  /// A loop showed that the body was off by `error`, [δp, δyaw]. `measured`: covariance of what the
  /// loop measured; `odometry`: of the error, as the odometry says it.
  void add(const Eigen::Vector4d& error, const Eigen::Matrix4d& measured,
           const Eigen::Matrix4d& odometry);

  /// By which covariances of the odometry are to be multiplied. An upper quantile: a scale that is
  /// too small makes wrong objects of right ones.
  double variance() const;

 private:
  double quantile_;
  std::vector<double> log_scales_;  ///< of deviations, a grid
  std::vector<double> log_posterior_;
};

}  // namespace perdure::mapping
