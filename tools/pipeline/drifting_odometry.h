// Odometry with the drift of vio, generated from true poses: a scale error and a random walk of the
// yaw, with their covariances.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "common/config/fields.h"
#include "common/sim/dice.h"
#include "tools/pipeline/odometry_source.h"

namespace perdure::tools {

/// The configuration of `drifting`, in which distances are too long by `scale` and yaw drifts.
struct DriftConfig {
  double scale = 0.005;        ///< relative error of the reported distance
  double scale_sigma = 0.0;    ///< declared standard deviation of `scale`; 0: |scale|
  double yaw_walk = 5.236e-4;  ///< rad/√m
  std::int64_t seed = 1;
  bool own_frame = false;
};
void describe(DriftConfig& config, config::Fields& fields);

/// Propagates the errors u of [yaw, p] in W and s of the scale: u' = A u + Δ s + noise, with Δ the
/// step. Messages do not contain s, so their transition is the best linear one for u alone:
/// Φ = E[u' uᵀ] P⁻¹ and Q = P' − Φ P Φᵀ, with P and P' the covariances of u and u'.
class DriftCovariance {
 public:
  DriftCovariance(double sigma_yaw, double sigma_position, double sigma_scale);
  /// Propagates over the reported step `step_W` (m) and a random yaw step with deviation
  /// `sigma_yaw`.
  void advance(const Eigen::Vector3d& step_W, double sigma_yaw);

  /// Covariance of [yaw, p, s].
  const Eigen::Matrix<double, 5, 5>& joint() const { return joint_; }
  /// Φ and Q of the last step.
  const Eigen::Matrix4d& transition() const { return transition_; }
  const Eigen::Matrix4d& noise() const { return noise_; }

 private:
  Eigen::Matrix<double, 5, 5> joint_;
  Eigen::Matrix4d transition_ = Eigen::Matrix4d::Identity(), noise_ = Eigen::Matrix4d::Zero();
};

/// Odometry that drifts in position and yaw; z of W stays exactly up. W is the frame of the poses,
/// or with `own_frame`, the level frame in which the first requested pose has position and yaw 0.
class DriftingOdometry {
 public:
  /// `accuracy`: the declared accuracy of the poses before the drift is added.
  DriftingOdometry(replay::PoseFile truth, InstanceId instance, const WorldId& session,
                   const PoseAccuracy& accuracy, const DriftConfig& config);
  /// Returns nothing if there is no pose for the frame. Frames must come in order.
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
  double turn_ = 0.0;  ///< yaw of W relative to the true frame
  RigidTransform true_T_WB_, T_WB_, T_WB_before_;
  Eigen::Vector3d v_WB_ = Eigen::Vector3d::Zero();
  std::optional<FrameStamp> last_, before_;
};

}  // namespace perdure::tools
