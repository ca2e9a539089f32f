#include "services/semantic_filter/core/predict.h"

#include <Eigen/LU>
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

}  // namespace

State stateAt(const Hypothesis& h, double dt) {
  State x = h.x;
  if (h.moving) x.head<3>() += dt * h.x.tail<3>();
  return x;
}

void predict(Object& object, TimePoint now, const PoseError& pose_error,
             const MotionParameters& parameters) {
  const double dt = toSeconds(now - object.as_of);
  const bool turned = object.pose_product != pose_error.product;
  const Matrix6d transition =
      turned ? Matrix6d(pose_error.product * object.pose_product.inverse()) : Matrix6d::Identity();
  for (auto& h : object.hypotheses) {
    if (dt > 0.0) predictHypothesis(h, dt, parameters);
    if (turned) h.C = (h.C * transition.transpose()).eval();
  }
  if (dt > 0.0) object.existence *= std::exp(-dt / parameters.survival_s);
  object.as_of = now;
  object.pose_product = pose_error.product;
}

}  // namespace perdure::semantic_filter
