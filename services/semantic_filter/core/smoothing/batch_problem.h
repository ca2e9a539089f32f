// All remembered batch at an track as one measurement of a cuboid: its residuals, Jacobians and
// full covariance, and the priors. What MapFit maximises; see smoother.h for the model.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/math/gaussian.h"
#include "services/semantic_filter/core/belief/noise_scale.h"
#include "services/semantic_filter/core/measurement/azimuth.h"
#include "services/semantic_filter/core/smoothing/keyframes.h"

namespace perdure::semantic_filter {

using Keyframes = std::vector<std::shared_ptr<const Keyframe>>;

using PoseJacobian = Eigen::Matrix<double, 4, 6>;

/// The batch at one track, and the covariances between the pose errors of all pairs of them, and
/// with the present one.
class KeyframeBatch {
 public:
  /// `keyframes` are in order of time and outlive this.
  KeyframeBatch(const Keyframes& keyframes, const PoseError& now);

  const Keyframes& keyframes() const { return *keyframes_; }
  std::size_t size() const { return keyframes_->size(); }
  /// True where all poses are exact.
  bool exactPoses() const { return exact_; }
  /// Of all sides, by their derivatives by the batch' poses; its lower triangle.
  void poseCovariance(const std::vector<PoseJacobian>& J, Eigen::MatrixXd& result) const;
  /// Of the present pose with look i.
  const Matrix6d& poseNow(std::size_t i) const { return now_[i]; }

 private:
  const Keyframes* keyframes_;
  bool chain(const PoseError& now);
  void pairUp(const PoseError& now);

  /// Φ_i (from the first look to look i) and Φ_i⁻¹ P_i: look i and an earlier j have the covariance
  /// Φ_i (Φ_j⁻¹ P_j). Of no size where a Φ_i has no inverse weight_of_each the name.
  std::vector<Matrix6d> onto_, from_;
  std::vector<Matrix6d> pairs_;  ///< then, of i and j <= i
  std::vector<Matrix6d> now_;
  bool exact_ = true;
};

/// Dimensions that a batch estimates: the cuboid, and the velocity of what moves.
inline constexpr int kMostFree = kGeometry + 3;
using FreeVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMostFree, 1>;
using FreeMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMostFree, kMostFree>;

/// Linearised at one state: four rows for each look.
struct Stack {
  /// [J r]: derivatives by geometry (and velocity), and z - h(x), pixels; 0 where a side does not
  /// count.
  Eigen::MatrixXd rows;
  std::vector<PoseJacobian> J_pose;
  std::vector<std::array<bool, 4>> counts;

  auto J() const { return rows.leftCols(rows.cols() - 1); }
  auto residual() const { return rows.col(rows.cols() - 1); }
};

/// Of the dimensions of a batch: [J r]ᵀ R⁻¹ [J r].
using Gram = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMostFree + 1, kMostFree + 1>;
Gram gramOf(const Eigen::MatrixXd& whitened);

/// Of the rows of a Stack given the cuboid, in two parts; of each the lower triangle alone.
struct SideCovariance {
  Eigen::MatrixXd own;   ///< by what the network and the thing itself do: noise, b, acceleration
  Eigen::MatrixXd pose;  ///< by the pose errors; of no size where poses are exact

  /// The whole, its own part widened by the batch' inflations. A doubtful box says nothing of the
  /// pose: its inflation does not widen the error that all share.
  Cholesky with(const Eigen::VectorXd& inflations, Eigen::MatrixXd storage = {}) const;
  /// What is left of the residuals r when the pose errors have been estimated from them: a common
  /// pose error is no contradiction. `explained` is R⁻¹ r, R the whole.
  Eigen::VectorXd withoutPose(const Eigen::VectorXd& residual,
                              const Eigen::VectorXd& explained) const;
  /// Squared deviation of one look with these residuals.
  double deviation(const Eigen::VectorXd& residual, Eigen::Index keyframe) const;
};

struct Quadratic {
  FreeMatrix G;  ///< information
  FreeVector g;  ///< its gradient: the maximum is at x + G⁻¹ g
};

/// `inflations` (one for each look, >= 1) widen whole batch; x has b = 0.
class BatchProblem {
 public:
  /// Of a class, at rest or moving. It faces as the azimuths say at the start, and its yaw is about
  /// what it is there.
  BatchProblem(const KeyframeBatch& batch, bool moving, const std::string& class_name,
               const State& start, const FrameContext& frame);

  int dim() const { return dim_; }
  bool moving() const { return dim_ == kMostFree; }
  State at(const State& x, const FreeVector& step) const;
  /// Nothing where a look does not see the cuboid at all.
  std::optional<Stack> linearise(const State& x) const;
  /// Into `result`, whose memory it takes.
  void covariance(const State& x, const Stack& s, SideCovariance& result) const;
  /// KeyframeBatch and priors at x.
  Quadratic quadratic(const State& x, const Gram& gram) const;
  /// Twice the negative logarithm of the priors, but for a constant and the azimuths.
  double priorCost(const State& x) const;
  /// The part of it that holds yaw to where it started.
  double yawPriorCost(const State& x) const;
  /// log p(azimuths | yaw modulo 180°), up to a constant.
  double logAzimuths(const State& x) const;
  /// Log-odds that the azimuths mean the yaw of x and not the one turned by 180°.
  double logHeading(const State& x) const;
  /// Of the azimuths that say something, beside what was assumed of their errors at first.
  /// `yaw_variance`: of the fit that x is of.
  ResidualRatio azimuthResidualRatio(const State& x, double yaw_variance) const;
  /// log |Λ / 2π| of the velocity's prior, which only what moves has.
  double logSpeedPrior() const;
  /// log |Λ| of the size's prior.
  double logSizePrior() const;
  /// The part of log |R| that is of no density: a side that is cut has a probability (of lying
  /// beyond the cut), and whether it counts depends on the state.
  double logVolumeOfCuts(const Stack& s, const Eigen::VectorXd& inflations) const;
  /// Covariance of the present b, in units of a box whose b has deviations `sigma`, with all rows.
  Eigen::MatrixXd biasNow(const State& x, const Stack& s, const Eigen::Vector4d& sigma,
                          const Eigen::VectorXd& inflations) const;
  /// Covariance of the present pose error with all rows.
  Eigen::MatrixXd poseNow(const Stack& s) const;

 private:
  double age(std::size_t keyframe) const;
  /// Of its box, as the network is known now.
  Eigen::Vector4d noise(const Keyframe& k) const;
  Eigen::Vector4d lasting(const Keyframe& k) const;
  Eigen::Matrix4d acceleration(const Stack& s, std::size_t i, std::size_t j) const;
  std::vector<AzimuthMatch> azimuths(const State& x) const;
  double azimuthVariance(const Keyframe& k) const;  ///< as the network is known now
  double azimuthWeight() const;
  void addAzimuths(const State& x, Quadratic& q) const;

  const KeyframeBatch& batch_;
  const FrameContext& frame_;
  ClassPrior prior_;
  std::string class_name_;
  double yaw_, heading_ = 0.0;
  int dim_;
  Eigen::Matrix3d size_information_, speed_information_ = Eigen::Matrix3d::Zero();
  ViewScales scales_{1, 1, 1};
};

}  // namespace perdure::semantic_filter
