#include "services/semantic_filter/core/belief/pose_correlation.h"

#include <algorithm>
#include <cmath>

#include "common/math/gaussian.h"
#include "common/math/small_cholesky.h"
#include "common/math/small_products.h"
#include "common/math/so3.h"

namespace perdure::semantic_filter {

namespace {

/// Whether P - C P_pose⁻¹ Cᵀ / share is positive definite. L_pose: Cholesky factor of P_pose.
bool isExplained(const Hypothesis& h, const Matrix6d& L_pose, double share) {
  CrossPose B = h.C;
  whitenRows(L_pose, B);
  StateCovariance rest = h.P - lowerTimesTransposed(B) / share;
  if (h.moving) return choleskyInPlace(rest);
  Eigen::Matrix<double, kVelocity, kVelocity> still = rest.topLeftCorner<kVelocity, kVelocity>();
  return choleskyInPlace(still);
}

/// Returns the Cholesky factor of P_pose; nothing if P_pose is not positive definite.
std::optional<Matrix6d> factorOf(const Matrix6d& P_pose) {
  std::optional<Matrix6d> L = P_pose;
  if (!choleskyInPlace(*L)) L.reset();
  return L;
}

double sigmaGivenPose(const Hypothesis& h, const std::optional<Matrix6d>& L_pose) {
  Eigen::Matrix<double, 3, 6> shared = Eigen::Matrix<double, 3, 6>::Zero();
  if (L_pose) {
    shared = h.C.topRows<3>();
    whitenRows(*L_pose, shared);
  }
  return std::sqrt(std::max(h.P.topLeftCorner<3, 3>().trace() - shared.squaredNorm(), 0.0));
}

}  // namespace

std::optional<Matrix6d> transitionBetween(const Matrix6d& earlier, const Matrix6d& later) {
  constexpr double kLargest = 10.0;
  if (earlier == later) return Matrix6d::Identity();
  // The inverse is stored, because most tracks of a frame were last updated at the same frame.
  thread_local Matrix6d product = Matrix6d::Identity(), inverted = Matrix6d::Identity();
  if (earlier != product) {
    product = earlier;
    inverted = inverse(earlier);
  }
  const Matrix6d transition = later.lazyProduct(inverted);
  const bool sane = transition.allFinite() && transition.cwiseAbs().maxCoeff() < kLargest;
  return sane ? std::optional(transition) : std::nullopt;
}

bool isJointCovariance(const Hypothesis& h, const Matrix6d& P_pose) {
  if (h.C.isZero(0.0)) return true;
  Matrix6d L = P_pose;
  return choleskyInPlace(L) && isExplained(h, L, 1.0);
}

/// Transitions are approximate, and the updates of vio shrink P_pose. So the pose error may explain
/// more than P. It may truly cause most of P: a limit of 0.9 costs half of the recall on KITTI.
void keepConsistent(Hypothesis& h, const Matrix6d& P_pose, const std::optional<Matrix6d>& L_pose) {
  constexpr double kExplained = 0.9999;
  if (h.C.isZero(0.0) || (L_pose && isExplained(h, *L_pose, kExplained))) return;
  const Eigen::Index n = h.moving ? kStateDim : kVelocity;
  const Cholesky P(h.P.topLeftCorner(n, n));
  const Cholesky pose(P_pose);
  if (!P.positive() || !pose.positive()) {
    h.C.setZero();
    return;
  }
  const Eigen::MatrixXd whitened = pose.whiten(P.whiten(h.C.topRows(n)).transpose());
  const double explained = eigenvalues(whitened * whitened.transpose()).maxCoeff();
  if (explained > kExplained) h.C *= std::sqrt(kExplained / explained);
}

void addPoseError(Hypothesis& h, const RigidTransform& T_WB, const Eigen::Vector3d& up_W,
                  const Matrix6d& P_pose) {
  Eigen::Matrix<double, kStateDim, 6> A = Eigen::Matrix<double, kStateDim, 6>::Zero();
  const Eigen::Matrix3d R_WB = T_WB.R();
  const Eigen::Vector3d p_B = T_WB.inverse() * Eigen::Vector3d(h.x.head<3>());
  A.block<3, 3>(0, 0) = -R_WB * skew(p_B);
  A.block<3, 3>(0, 3).setIdentity();
  A.block<1, 3>(kYaw, 0) = up_W.transpose() * R_WB;
  h.C = A * P_pose;
  h.P += A * P_pose * A.transpose();
  makeSymmetric(h.P);
}

double placeSigma(const Hypothesis& h, const Matrix6d& P_pose) {
  return sigmaGivenPose(h, factorOf(P_pose));
}

double placeSigma(const Track& track, const Matrix6d& P_pose) {
  const auto L_pose = factorOf(P_pose);
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const auto& h : track.hypotheses) mean += h.weight * h.x.head<3>();
  double variance = 0.0;
  for (const auto& h : track.hypotheses) {
    const double own = sigmaGivenPose(h, L_pose);
    variance += h.weight * (own * own + (h.x.head<3>() - mean).squaredNorm());
  }
  return std::sqrt(variance);
}

}  // namespace perdure::semantic_filter
