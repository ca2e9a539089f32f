// Estimates from loops the ratio of the true odometry error to the reported error. For poses
// without covariances the assumed random walk may be far too small or too large.
// Derivation: tools/docs/maths/drift_scale.md.
#pragma once

#include <Eigen/Core>
#include <map>
#include <vector>

#include "common/mapping/frames/anchor.h"
#include "common/mapping/graph/pose_graph.h"
#include "common/mapping/parameters.h"

namespace perdure::mapping {

/// Place and yaw share one scale. Heights have their own: odometry without gravity errs in pitch,
/// so that its height drifts far more than its place.
class DriftScale {
 public:
  /// `way`: anchors of one session in the order of travel. Their increments are taken without the
  /// factors of `Anchor::scale`.
  DriftScale(const DriftScaleParameters& parameters, const std::vector<Anchor>& way);

  /// Uses loops between anchors of the way, all at once: loops with common increments have common
  /// errors. Among the loops that end within one stretch of `apart_m`, the most accurate one is
  /// used, and of the stretches the newest twelve. Loops that the others contradict, and other
  /// edges, are left out. Returns whether one was used.
  bool use(const std::vector<Edge>& loops, double apart_m);

  /// The factors for covariances of the odometry at a quantile of the posterior, in (0, 1).
  DriftVariance variance(double quantile) const;

 private:
  /// The error of T_ab that a loop measured, in the axes of W.
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

  std::vector<LevelPose> poses_;  ///< by odometry
  std::vector<double> way_m_;
  std::map<AnchorId, std::size_t> at_;  ///< index of each anchor
  /// Sums of the increments' covariances up to each anchor, as errors of position at W's origin.
  std::vector<Eigen::Matrix4d> sums_;
  std::vector<double> log_scales_;  ///< grid over the scale of the standard deviation
  LogPosterior plane_, height_;
};

}  // namespace perdure::mapping
