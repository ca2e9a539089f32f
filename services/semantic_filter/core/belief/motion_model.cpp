#include "services/semantic_filter/core/belief/motion_model.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/math/gaussian.h"
#include "common/math/so3.h"
#include "services/semantic_filter/core/belief/mixture_ops.h"

namespace perdure::semantic_filter {

constexpr double kNoWeight = 1e-12;

double fasterThan(const Hypothesis& h, double limit) {
  const Eigen::Vector2d v = h.x.segment<2>(kVelocity);
  const Eigen::Matrix2d P = h.P.block<2, 2>(kVelocity, kVelocity);
  const double speed = v.norm();
  const double variance = speed > 1e-3 ? v.dot(P * v) / (speed * speed) : P.trace();
  const double scale = std::sqrt(2.0 * std::max(variance, 0.0)) + 1e-6;
  return 0.5 * (std::erfc((limit - speed) / scale) + std::erfc((limit + speed) / scale));
}

double movingProbability(const Track& track, double min_speed) {
  double sum = 0.0;
  for (const auto& h : track.hypotheses) {
    if (h.moving) sum += h.weight * fasterThan(h, min_speed);
  }
  return std::min(sum, 1.0);
}

void predictHypothesis(Hypothesis& h, double dt, const MotionParameters& m) {
  h.x = stateAt(h, dt);
  if (!h.moving) {
    h.P.diagonal().head<3>().array() += m.position_walk * m.position_walk * dt;
    h.P(kYaw, kYaw) += m.yaw_walk * m.yaw_walk * dt;
    return;
  }
  h.P.topRows<3>() += dt * h.P.bottomRows<3>();
  h.P.leftCols<3>() += dt * h.P.rightCols<3>();
  h.C.topRows<3>() += dt * h.C.bottomRows<3>();
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

void stop(Hypothesis& h) {
  const Eigen::Matrix3d S = h.P.bottomRightCorner<3, 3>();
  const Eigen::Matrix<double, kStateDim, 3> K = regressOn(S, h.P.rightCols<3>());
  h.x -= K * Eigen::Vector3d(h.x.tail<3>());
  h.x[kYaw] = wrapAngle(h.x[kYaw]);
  h.P = (h.P - K * S * K.transpose()).eval();
  h.C = (h.C - K * h.C.bottomRows<3>()).eval();
  h.moving = false;
  h.x.tail<3>().setZero();
  h.P.bottomRows<3>().setZero();
  h.P.rightCols<3>().setZero();
  h.C.bottomRows<3>().setZero();
  makeSymmetric(h.P);
}

void stopSlowHypotheses(Track& track, double min_speed) {
  const std::size_t count = track.hypotheses.size();
  for (std::size_t i = 0; i < count; ++i) {
    const Hypothesis& moving = track.hypotheses.read()[i];
    if (!moving.moving) continue;
    const double fast = fasterThan(moving, min_speed);
    if (fast > 0.5) continue;
    Hypothesis rest = moving;
    stop(rest);
    rest.weight *= 1.0 - fast;
    track.hypotheses[i].weight *= fast;
    track.hypotheses.push_back(std::move(rest));
  }
  if (track.hypotheses.size() == count) return;
  std::erase_if(track.hypotheses.write(), [](const Hypothesis& h) { return h.weight < kNoWeight; });
  normalise(track, ClassEvidence::kMotion);
}

State stateAt(const Hypothesis& h, double dt) {
  State x = h.x;
  if (h.moving) x.head<3>() += dt * h.x.tail<3>();
  return x;
}

Track extrapolated(Track track, TimePoint time, const MotionParameters& parameters) {
  const double dt = toSeconds(time - track.as_of);
  if (dt <= 0.0) return track;
  for (auto& h : track.hypotheses) predictHypothesis(h, dt, parameters);
  return track;
}

Hypothesis asMoving(Hypothesis at_rest) {
  at_rest.ground_contact = {};
  at_rest.moving = true;
  at_rest.P.bottomRightCorner<3, 3>().diagonal() << 9.0, 9.0, 0.04;  // (3 m/s)²
  return at_rest;
}

}  // namespace perdure::semantic_filter
