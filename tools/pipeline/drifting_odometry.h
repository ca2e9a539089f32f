// Odometry that drifts as vio does, made from true poses: a scale error and a walk of the yaw, with
// the covariances that belong to them.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "common/config/fields.h"
#include "common/sim/dice.h"
#include "tools/pipeline/odometry_source.h"

namespace perdure::tools {

/// As people configure it; service `drifting`.
struct DriftConfig {
  double scale = 0.005;        ///< the way is reported longer by this share
  double scale_sigma = 0.0;    ///< deviation that is declared of it; 0: |scale|
  double yaw_walk = 5.236e-4;  ///< rad/√m
  std::int64_t seed = 1;
  bool own_frame = false;
};
void describe(DriftConfig& config, config::Fields& fields);

/// How the error of [yaw, p] (u) and of the scale (s) grows, in W: u' = A u + Δ s + noise. Between
/// frames s is not kept, so the transition that is given is the best one for u alone:
/// Φ = E[u' uᵀ] P⁻¹ and Q = P' − Φ P Φᵀ.
class DriftCovariance {
 public:
  DriftCovariance(double sigma_yaw, double sigma_position, double sigma_scale);
  /// The body went by `step_W`, as reported, and then its yaw walked by `sigma_yaw`.
  void advance(const Eigen::Vector3d& step_W, double sigma_yaw);

  /// Of [yaw, p, s].
  const Eigen::Matrix<double, 5, 5>& joint() const { return joint_; }
  /// Φ and Q of the last step.
  const Eigen::Matrix4d& transition() const { return transition_; }
  const Eigen::Matrix4d& noise() const { return noise_; }

 private:
  Eigen::Matrix<double, 5, 5> joint_;
  Eigen::Matrix4d transition_ = Eigen::Matrix4d::Identity(), noise_ = Eigen::Matrix4d::Zero();
};

/// Gravity stays exact: z of W is up. W is the poses' frame, or with `own_frame` the level one in
/// which the first pose that is asked for has position and yaw 0.
class DriftingOdometry {
 public:
  /// `accuracy`: what is declared of the poses before they drift.
  DriftingOdometry(replay::PoseFile truth, InstanceId instance, const WorldId& session,
                   const PoseAccuracy& accuracy, const DriftConfig& config);
  /// Nothing where there is no pose for the frame. Frames come in order.
  std::optional<Odometry> at(const FrameStamp& stamp);

 private:
  void begin(const RigidTransform& true_T_WB);
  void advance(const RigidTransform& true_T_WB, double seconds);
  Odometry tell(const FrameStamp& stamp) const;

  replay::PoseFile truth_;
  InstanceId instance_;
  WorldId session_;
  PoseAccuracy accuracy_;
  DriftConfig config_;
  sim::Dice dice_;
  DriftCovariance covariance_;
  double turn_ = 0.0;  ///< of W against the truth's, about z
  RigidTransform true_T_WB_, T_WB_, T_WB_before_;
  Eigen::Vector3d v_WB_ = Eigen::Vector3d::Zero();
  std::optional<FrameStamp> last_, before_;
};

}  // namespace perdure::tools
