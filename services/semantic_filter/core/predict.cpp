#include "services/semantic_filter/core/predict.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <cmath>

namespace perdure::semantic_filter {
namespace {

void predictHypothesis(Hypothesis& h, double dt, const MotionParameters& m) {
  h.x = stateAt(h, dt);
  if (!h.moving) {
    h.P.diagonal().head<3>().array() += m.position_walk * m.position_walk * dt;
    h.P(kYaw, kYaw) += m.yaw_walk * m.yaw_walk * dt;
    return;
  }
  StateCovariance F = StateCovariance::Identity();
  F.block<3, 3>(0, kVelocity).diagonal().setConstant(dt);
  h.P = (F * h.P * F.transpose()).eval();
  h.C = (F * h.C).eval();
  const double q = m.acceleration * m.acceleration;
  for (int i = 0; i < 3; ++i) {
    const double axis_q = i < 2 ? q : 0.01 * q;
    h.P(i, i) += axis_q * dt * dt * dt / 3.0;
    h.P(i, kVelocity + i) += axis_q * dt * dt / 2.0;
    h.P(kVelocity + i, i) += axis_q * dt * dt / 2.0;
    h.P(kVelocity + i, kVelocity + i) += axis_q * dt;
  }
  h.P(kYaw, kYaw) += 25.0 * m.yaw_walk * m.yaw_walk * dt;
}

/// The transition since the object was brought up to date. vio's updates make the product of
/// transitions small, so that its inverse may lose its sense: then nothing is left of C.
Matrix6d transitionSince(const Object& object, const PoseError& pose_error) {
  constexpr double kLargest = 10.0;
  if (object.pose_product == pose_error.product) return Matrix6d::Identity();
  const Matrix6d transition = pose_error.product * object.pose_product.inverse();
  const bool sane = transition.allFinite() && transition.cwiseAbs().maxCoeff() < kLargest;
  return sane ? transition : Matrix6d::Zero();
}

/// [P C; Cᵀ P_pose] must stay a covariance. Transitions are approximate, and vio's own updates
/// shrink P_pose: C is scaled down where the pose would explain more of P than there is. (Much of
/// P may well be the pose: a limit of .9 here costs half of the recall on KITTI.)
void keepConsistent(Hypothesis& h, const Matrix6d& P_pose) {
  constexpr double kExplained = 0.9999;
  if (h.C.isZero(0.0)) return;
  const Eigen::Index n = h.moving ? kStateDim : kVelocity;
  const Eigen::LLT<Eigen::MatrixXd> P(h.P.topLeftCorner(n, n));
  const Eigen::LLT<Matrix6d> pose(P_pose);
  if (P.info() != Eigen::Success || pose.info() != Eigen::Success) {
    h.C.setZero();
    return;
  }
  const Eigen::MatrixXd half = P.matrixL().solve(Eigen::MatrixXd(h.C.topRows(n)));
  const Eigen::MatrixXd whitened = pose.matrixL().solve(Eigen::MatrixXd(half.transpose()));
  const double correlation = Eigen::JacobiSVD<Eigen::MatrixXd>(whitened).singularValues()[0];
  if (correlation * correlation > kExplained) h.C *= std::sqrt(kExplained) / correlation;
}

}  // namespace

State stateAt(const Hypothesis& h, double dt) {
  State x = h.x;
  if (h.moving) x.head<3>() += dt * h.x.tail<3>();
  return x;
}

void predict(Object& object, TimePoint now, const PoseError& pose_error,
             const MotionParameters& parameters) {
  const double dt = toSeconds(now - object.as_of);
  const Matrix6d transition = transitionSince(object, pose_error);
  for (auto& h : object.hypotheses) {
    if (dt > 0.0) predictHypothesis(h, dt, parameters);
    h.C = (h.C * transition.transpose()).eval();
    keepConsistent(h, pose_error.covariance);
  }
  if (dt > 0.0) object.existence *= std::exp(-dt / parameters.survival_s);
  object.as_of = now;
  object.pose_product = pose_error.product;
}

}  // namespace perdure::semantic_filter
