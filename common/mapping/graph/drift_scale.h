// Estimates from loops the ratio of the true odometry error to the reported error. For poses
// without covariances, the assumed random walk may be far too small or too large. Derivation:
// tools/docs/maths/drift_scale.md.
#pragma once

#include <Eigen/Core>
#include <map>
#include <vector>

#include "common/mapping/frames/anchor.h"
#include "common/mapping/graph/pose_graph.h"
#include "common/mapping/parameters.h"

namespace perdure::mapping {

/// x, y and yaw share one scale. Height has its own, because odometry without gravity errs in
/// pitch, and its height drifts far more than its x and y.
class DriftScale {
 public:
  /// `way`: anchors of one session in the order of travel. Divides the factors of `Anchor::scale`
  /// out of the covariances of their increments.
  DriftScale(const DriftScaleParameters& parameters, const std::vector<Anchor>& way);

  /// Uses loops between anchors of the way jointly, because loops with common increments have
  /// common errors. Uses the most accurate of the loops that end in one stretch of `apart_m`,
  /// and of all stretches the newest twelve. Leaves out loops that the others contradict, and other
  /// edges. Returns whether any loop was used.
  bool use(const std::vector<Edge>& loops, double apart_m);

  /// Returns the factors of the odometry's covariances at a quantile, in (0, 1), of the posterior.
  DriftVariance variance(double quantile) const;

 private:
  /// The error of the odometry's T_ab as measured by a loop, in the axes of W.
  struct Measured {
    std::size_t a = 0, b = 0;  ///< indices of the way
    Eigen::Vector4d error;
    Eigen::Matrix4d covariance;
  };
  using LogPosterior = std::vector<double>;  ///< over log_scales_

  struct Joint;

  Measured measuredBy(const Edge& loop) const;
  Joint joint(const std::vector<Measured>& loops, const std::vector<int>& parts) const;
  double logEvidence(const std::vector<Measured>& loops) const;
  void dropWrong(std::vector<Measured>& loops) const;
  Eigen::Matrix4d sharedError(const Measured& x, const Measured& y) const;
  double varianceOf(const LogPosterior& log_posterior, double quantile) const;

  std::vector<LevelPose> poses_;  ///< poses of the anchors by odometry
  std::vector<double> way_m_;
  std::map<AnchorId, std::size_t> at_;  ///< index of each anchor
  /// Sums of the increments' covariances up to each anchor, with positions referred to W's origin.
  std::vector<Eigen::Matrix4d> sums_;
  std::vector<double> log_scales_;  ///< grid of the logarithm of the standard deviation's scale
  LogPosterior plane_, height_;
};

}  // namespace perdure::mapping
