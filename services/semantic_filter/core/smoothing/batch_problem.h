// Residuals, Jacobians and covariance of all keyframes of a track as one measurement of a cuboid,
// and the priors (Dellaert, Kaess 2017). Derivation: tools/docs/maths/map_fit.md.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/math/gaussian.h"
#include "services/semantic_filter/core/belief/classes/upper_part.h"
#include "services/semantic_filter/core/belief/learned.h"
#include "services/semantic_filter/core/smoothing/keyframes.h"
#include "services/semantic_filter/core/update/azimuth_update.h"

namespace perdure::semantic_filter {

using Keyframes = std::vector<std::shared_ptr<const Keyframe>>;

/// The matrices of a batch have bounded sizes, so they need no heap memory.
inline constexpr int kMostSides = 4 * kMostKeyframes;
using PerKeyframe = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMostKeyframes, 1>;
/// One number for each side, four sides per keyframe.
using PerSide = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMostSides, 1>;
using SideMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMostSides, kMostSides>;

using PoseJacobian = Eigen::Matrix<double, 4, 6>;

/// The keyframes of one track, with the covariances of their pose errors and of the present one.
class KeyframeBatch {
 public:
  /// `keyframes`: in order of time; they outlive this object.
  KeyframeBatch(const Keyframes& keyframes, const PoseError& now);

  const Keyframes& keyframes() const { return *keyframes_; }
  std::size_t size() const { return keyframes_->size(); }
  bool exactPoses() const { return exact_; }
  /// Computes the covariance that the pose errors cause in all sides, px²; only its lower triangle.
  /// `J`: derivatives of the sides by the pose error, for each keyframe.
  void poseCovariance(const ScratchVector<PoseJacobian>& J, SideMatrix& result) const;
  /// Returns the covariance of the present pose error with that of keyframe i.
  const Matrix6d& poseNow(std::size_t i) const { return now_[i]; }

 private:
  const Keyframes* keyframes_;
  /// Fills onto_, from_ and now_. Returns false if a transition has no usable inverse.
  bool chain(const PoseError& now);
  /// Fills pairs_ and now_, if chain() fails.
  void pairUp(const PoseError& now);

  /// Φ_i (from the first keyframe to keyframe i) and Φ_i⁻¹ P_i. Keyframe i and an earlier keyframe
  /// j have the covariance Φ_i (Φ_j⁻¹ P_j). Empty if a Φ_i has no usable inverse.
  ScratchVector<Matrix6d> onto_, from_;
  ScratchVector<Matrix6d> pairs_;  ///< if chain() fails: covariances of i and j <= i
  ScratchVector<Matrix6d> now_;    ///< covariance of the present pose error with keyframe i
  bool exact_ = true;
};

/// Most dimensions of an estimate: the cuboid, and the velocity of a moving hypothesis.
inline constexpr int kMostFree = kGeometry + 3;
using FreeVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMostFree, 1>;
using FreeMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMostFree, kMostFree>;

/// Four rows for each keyframe; a column for each dimension, and the residual.
using SideRows =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMostSides, kMostFree + 1>;

/// The measurement, linearised at one state: four rows for each keyframe.
struct Stack {
  /// [J r]: derivatives, and z - h(x), px; 0 for a side that does not count.
  SideRows rows;
  ScratchVector<PoseJacobian> J_pose;
  ScratchVector<std::array<bool, 4>> counts;

  auto J() const { return rows.leftCols(rows.cols() - 1); }
  auto residual() const { return rows.col(rows.cols() - 1); }
};

/// [J r]ᵀ R⁻¹ [J r].
using Gram = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMostFree + 1, kMostFree + 1>;
/// `whitened`: L⁻¹ [J r], where R = L Lᵀ.
Gram gramOf(const SideRows& whitened);

/// Covariance of the rows of a Stack, given the cuboid, in two parts, px². Only lower triangles.
struct SideCovariance {
  SideMatrix own;   ///< of noise, b and acceleration
  SideMatrix pose;  ///< of the pose errors; empty if poses are exact

  /// Factorises R: the sum of `own`, widened by the inflations, and `pose`. `pose` is not widened,
  /// because the pose error would then seem observed.
  void factorise(const PerKeyframe& inflations, Cholesky<SideMatrix>& R) const;
  /// Returns the residuals r without the pose errors estimated from them. `explained`: R⁻¹ r.
  PerSide withoutPose(const PerSide& residual, const PerSide& explained) const;
  /// Returns the squared Mahalanobis distance of the residuals of one keyframe, given `own`.
  double deviation(const PerSide& residual, Eigen::Index keyframe) const;
};

template <int Columns>
using SideColumns = Eigen::Matrix<double, Eigen::Dynamic, Columns, 0, kMostSides, Columns>;

struct Quadratic {
  FreeMatrix G;  ///< information
  FreeVector g;  ///< gradient; the maximum is at x + G⁻¹ g
};

/// Posterior of a cuboid given all keyframes. Every x has b = 0. `inflations`: one for each
/// keyframe, >= 1, the factor on the variances of its sides.
class BatchProblem {
 public:
  /// `kind`: gives class, motion and extent (whole object or upper part). `start`: gives the mean
  /// of the yaw prior, and the heading.
  BatchProblem(const KeyframeBatch& batch, const Hypothesis& kind, const State& start,
               const FrameContext& frame);

  int dim() const { return dim_; }
  bool moving() const { return dim_ == kMostFree; }
  State at(const State& x, const FreeVector& step) const;
  /// Returns nothing if the cuboid has no projection in one of the keyframes.
  std::optional<Stack> linearise(const State& x) const;
  /// Writes the covariance of the rows of `s` to `result`, whose memory is reused.
  void covariance(const State& x, const Stack& s, SideCovariance& result) const;
  Quadratic quadratic(const State& x, const Gram& gram) const;
  /// Returns -2 log of the priors, without a constant and without the azimuths.
  double priorCost(const State& x) const;
  /// Returns the part of priorCost that comes from the yaw prior around the start.
  double yawPriorCost(const State& x) const;
  /// Returns log p(azimuths | yaw modulo 180°), without a constant.
  double logAzimuths(const State& x) const;
  /// Returns the log-odds, by the azimuths, that the yaw of x is not turned by 180°.
  double logHeading(const State& x) const;
  /// Returns the squared residuals of informative azimuths, relative to the assumed variances.
  /// `yaw_variance`: of the estimate, rad².
  ResidualRatio azimuthResidualRatio(const State& x, double yaw_variance) const;
  /// Returns log |Λ / 2π| of the velocity prior; 0 at rest.
  double logSpeedPrior() const;
  double logSizePrior() const;
  /// Returns the part of log |R| that is not part of a density: that of sides that are cut or do
  /// not count.
  double logVolumeOfCuts(const Stack& s, const PerKeyframe& inflations) const;
  /// Returns the covariance of all rows with the present b of deviations `sigma` (widths, heights).
  SideColumns<4> biasNow(const State& x, const Stack& s, const Eigen::Vector4d& sigma,
                         const PerKeyframe& inflations) const;
  /// Returns the variances of the noise in all rows, widened; 0 for a side that does not count.
  PerSide noiseOf(const Stack& s, const PerKeyframe& inflations) const;
  /// Returns the covariance of all rows with the present pose error.
  SideColumns<6> poseNow(const Stack& s) const;

 private:
  /// Returns the time from a keyframe to the newest one, s; 0 at rest. The position is that at the
  /// newest keyframe.
  double age(std::size_t keyframe) const;
  /// Return the variances of the sides by noise and by b, px², with the present scales.
  Eigen::Vector4d noise(const Keyframe& k) const;
  Eigen::Vector4d lasting(const Keyframe& k) const;
  /// Returns the covariance of the sides of keyframe i and an earlier or equal j that white
  /// acceleration causes between them and the newest keyframe, px².
  Eigen::Matrix4d acceleration(const Stack& s, std::size_t i, std::size_t j) const;
  ScratchVector<AzimuthMatch> azimuths(const State& x) const;
  double azimuthVariance(const Keyframe& k) const;  ///< rad², with the present noise scale
  /// Returns the weight of each azimuth, given that their errors are correlated.
  double azimuthWeight() const;
  void addAzimuths(const State& x, Quadratic& q) const;

  const KeyframeBatch& batch_;
  const FrameContext& frame_;
  ClassPrior prior_;
  SizePrior size_;
  std::string class_name_;
  double yaw_, heading_ = 0.0;
  int dim_;
  Eigen::Matrix3d size_information_, speed_information_ = Eigen::Matrix3d::Zero();
  ViewScales scales_{1, 1, 1};
};

}  // namespace perdure::semantic_filter
