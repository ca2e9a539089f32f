#include "services/semantic_filter/core/memory/drift.h"

#include <algorithm>
#include <cmath>

#include "common/math/gaussian.h"
#include "common/math/so3.h"
#include "services/semantic_filter/core/belief/pose_correlation.h"
#include "services/semantic_filter/core/parameters.h"

namespace perdure::semantic_filter {
namespace {

/// d[θ, p] by d[yaw, p].
Eigen::Matrix<double, 6, 4> level(const RigidTransform& T_MB) {
  Eigen::Matrix<double, 6, 4> G = Eigen::Matrix<double, 6, 4>::Zero();
  G.topLeftCorner<3, 1>() = T_MB.R().transpose() * Eigen::Vector3d::UnitZ();
  G.bottomRightCorner<3, 3>().setIdentity();
  return G;
}

}  // namespace

std::optional<DriftMeasurement> driftMeasurement(const Hypothesis& h, const ProjectedBox& predicted,
                                                 const BoxMeasurement& z,
                                                 const std::array<bool, 4>& hidden,
                                                 const Matrix6d& P_pose) {
  const auto use = comparableSides(z, predicted, hidden);
  const auto n = static_cast<Eigen::Index>(std::count(use.begin(), use.end(), true));
  if (n == 0) return std::nullopt;
  const Eigen::Matrix<double, kVelocity, 6> B = regressOn(P_pose, h.C.topRows<kVelocity>());
  Eigen::MatrixXd H(n, kVelocity), D(n, 6);
  Eigen::VectorXd residual(n), variance(n);
  Eigen::Index row = 0;
  for (int side = 0; side < 4; ++side) {
    if (!use[static_cast<std::size_t>(side)]) continue;
    H.row(row) = predicted.H.row(side).head<kVelocity>();
    D.row(row) = H.row(row) * B + predicted.H_pose.row(side);
    residual[row] = z.sides[side] - predicted.sides[side];
    variance[row++] = z.variance[side];
  }
  const Eigen::MatrixXd P = h.P.topLeftCorner<kVelocity, kVelocity>() - B * P_pose * B.transpose();
  Eigen::MatrixXd S = H * P * H.transpose();
  S.diagonal() += variance;
  if (!isCovariance(S)) return std::nullopt;
  if (squaredMahalanobis(residual, S + D * P_pose * D.transpose()) > gates::kDriftOutlier)
    return std::nullopt;
  const Eigen::MatrixXd W = solveSymmetric(S, D);
  return DriftMeasurement{D.transpose() * W, W.transpose() * residual};
}

void DriftEstimator::predict(const RigidTransform& from, const RigidTransform& to,
                             double rotation_walk, double position_walk) {
  const Eigen::Vector3d way = to.p - from.p;
  Eigen::Matrix4d F = Eigen::Matrix4d::Identity();
  F(1, 0) = -way.y();
  F(2, 0) = way.x();
  g_ = (F * g_).eval();
  P_ = (F * P_ * F.transpose()).eval();
  const double metres = way.norm();
  P_(0, 0) += metres * rotation_walk * rotation_walk;
  P_.diagonal().tail<3>().array() += metres * position_walk * position_walk;
}

void DriftEstimator::add(const std::vector<DriftMeasurement>& measurements,
                         const RigidTransform& T_MB) {
  if (measurements.empty() || !isCovariance(P_)) return;
  const Eigen::Matrix<double, 6, 4> G = level(T_MB);
  Eigen::Matrix4d information = inverseSymmetric(P_);
  Eigen::Vector4d pull = information * g_;
  for (const DriftMeasurement& measurement : measurements) {
    information += G.transpose() * measurement.information * G;
    pull += G.transpose() * measurement.pull;
  }
  P_ = inverseSymmetric(information);
  makeSymmetric(P_);
  g_ = P_ * pull;
  things_ += measurements.size();
}

std::optional<PoseCorrection> DriftEstimator::correct(const RigidTransform& T_MB,
                                                      const PoseError& pose_error) {
  if (things_ < static_cast<std::size_t>(parameters_.things) || !isCovariance(P_)) {
    return std::nullopt;
  }
  if (g_.tail<3>().norm() < parameters_.position && std::abs(g_[0]) < parameters_.rotation) {
    return std::nullopt;
  }
  if (squaredMahalanobis(g_, P_) < gates::kSignificantDrift ||
      !isCovariance(pose_error.covariance)) {
    return std::nullopt;
  }
  const Eigen::Matrix<double, 6, 4> G = level(T_MB);
  Matrix6d tilt = Matrix6d::Identity();  // keeps the part that is not yaw
  tilt.topLeftCorner<3, 3>() -= G.topLeftCorner<3, 1>() * G.topLeftCorner<3, 1>().transpose();
  tilt.bottomRightCorner<3, 3>().setZero();
  PoseCorrection correction;
  correction.error = G * g_;
  correction.before = pose_error.covariance;
  correction.after = tilt * pose_error.covariance * tilt.transpose() + G * P_ * G.transpose();
  const Eigen::Matrix3d R = rotationAboutZ(g_[0]);
  correction.step = RigidTransform(Eigen::Quaterniond(R), T_MB.p + g_.tail<3>() - R * T_MB.p);
  g_.setZero();
  things_ = 0;
  return correction;
}

void applyCorrection(Track& track, const PoseCorrection& correction, const PoseError& pose_error) {
  const auto transition = transitionBetween(track.pose.product, pose_error.product);
  if (!transition) return;
  for (Hypothesis& h : track.hypotheses) {
    const CrossPose C = h.C * transition->transpose();
    h.x += regressOn(correction.before, C) * correction.error;
    h.x[kYaw] = wrapAngle(h.x[kYaw]);
  }
}

}  // namespace perdure::semantic_filter
