#include "services/vio/core/propagation/imu_propagator.h"

#include <algorithm>

#include "common/base/check.h"
#include "common/math/so3.h"

namespace perdure::vio {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// Returns the rotation vector over `dt` if the rate changes linearly from w0 to w1 (second-order
/// Magnus).
Vector3d turned(const Vector3d& w0, const Vector3d& w1, double dt) {
  return 0.5 * (w0 + w1) * dt + w0.cross(w1) * (dt * dt / 12.0);
}

/// Rotation of one step, and its derivatives by bias and scale. Both affect the rates at the start
/// and at the end.
struct Turn {
  Matrix3d R, J_bias, J_scale;  ///< derivatives of R's right tangent by bias and scale
};

Turn turn(const Vector3d& w0, const Vector3d& w1, double dt, const Vector3d& scale) {
  const Vector3d theta = turned(w0, w1, dt);
  const Matrix3d half = 0.5 * dt * Matrix3d::Identity(), J = rightJacobianSo3(theta);
  const double c = dt * dt / 12.0;
  const Matrix3d J0 = J * (half - c * skew(w1)), J1 = J * (half + c * skew(w0));
  const Vector3d by = -scale.cwiseInverse();  // d w / d bias; d w / d scale is this times w
  return {expSo3(theta), (J0 + J1) * by.asDiagonal(),
          (J0 * w0.asDiagonal() + J1 * w1.asDiagonal()) * by.asDiagonal()};
}

/// Time constant with which the linearisation velocity follows the estimated one, s.
constexpr double kFollow = 1.0;

struct Densities {
  double gyro2, accel2;
};

/// Returns the square noise density of values interpolated over `span`. `change2` is the square of
/// their change over `dt`, a part of it.
double interpolationDensity(double span, double dt, double change2, double floor, double gap,
                            const ImuNoise& noise) {
  if (span <= noise.interpolation_from_s) return 0.0;
  const double whole = span / dt;  // ratio of the whole span to dt
  double variance = floor * floor + whole * whole * change2 / 12.0;
  if (span > noise.gap_from_s) variance += gap * gap;
  return span * variance;
}

/// Returns the squared noise densities of one step, including the interpolation error of sparse
/// samples.
Densities densities(const ImuReading& a, const ImuReading& b, double dt, const ImuNoise& noise) {
  const auto added = [&](double span, const Vector3d& change, double floor, double gap) {
    return interpolationDensity(std::max(span, dt), dt, change.squaredNorm(), floor, gap, noise);
  };
  const double inflation2 = noise.inflation * noise.inflation;
  return {inflation2 * noise.gyro * noise.gyro +
              added(b.gyro_span_s, b.gyro - a.gyro, noise.interpolation_gyro, noise.gap_gyro),
          inflation2 * noise.accel * noise.accel +
              added(b.accel_span_s, b.accel - a.accel, noise.interpolation_accel, noise.gap_accel)};
}

void step(ImuIncrement& x, const ImuReading& a, const ImuReading& b, const Vector3d& bg,
          const Vector3d& ba, const ImuNoise& noise, const Vector3d& scale) {
  const double dt = toSeconds(b.time - a.time);
  const Vector3d w0 = (a.gyro - bg).cwiseQuotient(scale), w1 = (b.gyro - bg).cwiseQuotient(scale);
  const Vector3d wm = 0.5 * (w0 + w1);
  const Vector3d f0 = a.accel - ba, f1 = b.accel - ba, fm = 0.5 * (f0 + f1);
  const Turn half = turn(w0, wm, 0.5 * dt, scale), whole = turn(w0, w1, dt, scale);
  const Matrix3d R0 = x.dq.toRotationMatrix(), Rm = R0 * half.R, R1 = R0 * whole.R;

  // Derivatives of R f by the rotation at the start, the gyro bias and the scale, at the start,
  // middle and end of the step.
  const Matrix3d A0 = -R0 * skew(f0), Am = -Rm * skew(fm), A1 = -R1 * skew(f1);
  const Matrix3d Am_t = Am * half.R.transpose(), A1_t = A1 * whole.R.transpose();
  const Matrix3d Am_b = Am * half.J_bias, A1_b = A1 * whole.J_bias;
  const Matrix3d Am_s = Am * half.J_scale, A1_s = A1 * whole.J_scale;
  const double v6 = dt / 6.0, p6 = dt * dt / 6.0;

  Matrix15d F = Matrix15d::Identity();
  F.block<3, 3>(kTheta, kTheta) = whole.R.transpose();
  F.block<3, 3>(kTheta, kGyroBias) = whole.J_bias;
  F.block<3, 3>(kPosition, kTheta) = p6 * (A0 + 2.0 * Am_t);
  F.block<3, 3>(kPosition, kVelocity) = dt * Matrix3d::Identity();
  F.block<3, 3>(kPosition, kGyroBias) = p6 * 2.0 * Am_b;
  F.block<3, 3>(kPosition, kAccelBias) = -p6 * (R0 + 2.0 * Rm);
  F.block<3, 3>(kVelocity, kTheta) = v6 * (A0 + 4.0 * Am_t + A1_t);
  F.block<3, 3>(kVelocity, kGyroBias) = v6 * (4.0 * Am_b + A1_b);
  F.block<3, 3>(kVelocity, kAccelBias) = -v6 * (R0 + 4.0 * Rm + R1);
  Matrix93d by_scale;
  by_scale << whole.J_scale, p6 * 2.0 * Am_s, v6 * (4.0 * Am_s + A1_s);

  const Densities d = densities(a, b, dt, noise);
  const Matrix3d I = Matrix3d::Identity();
  Matrix15d Q = Matrix15d::Zero();
  Q.block<3, 3>(kTheta, kTheta) = d.gyro2 * dt * I;
  Q.block<3, 3>(kPosition, kPosition) = d.accel2 * dt * dt * dt / 3.0 * I;
  Q.block<3, 3>(kPosition, kVelocity) = d.accel2 * dt * dt / 2.0 * I;
  Q.block<3, 3>(kVelocity, kPosition) = d.accel2 * dt * dt / 2.0 * I;
  Q.block<3, 3>(kVelocity, kVelocity) = d.accel2 * dt * I;
  const double gyro_walk = noise.inflation * noise.gyro_walk;
  const double accel_walk = noise.inflation * noise.accel_walk;
  Q.block<3, 3>(kGyroBias, kGyroBias) = gyro_walk * gyro_walk * dt * I;
  Q.block<3, 3>(kAccelBias, kAccelBias) = accel_walk * accel_walk * dt * I;

  x.by_scale = (F.topLeftCorner<9, 9>() * x.by_scale + by_scale).eval();
  x.F = (F * x.F).eval();
  x.Q = (F * x.Q * F.transpose() + Q).eval();
  x.dp += x.dv * dt + p6 * (R0 * f0 + 2.0 * (Rm * fm));
  x.dv += v6 * (R0 * f0 + 4.0 * (Rm * fm) + R1 * f1);
  x.dq = Eigen::Quaterniond(R1).normalized();
  x.dt += dt;
  x.end_rate = w1;
  x.mean_rate += dt * wm;
  x.mean_force += dt * fm;
}

/// Transition of the navigation error, and its derivative by the error of the gyroscope's scale.
struct Moves {
  const Matrix15d& Phi;
  Matrix93d by_scale;
  std::optional<int> scale_at;
};

Matrix15d movedNav(const State& state, const Moves& m, const Matrix15d& Q) {
  const auto P = state.P();
  Matrix15d result = m.Phi * P.topLeftCorner<kNavSize, kNavSize>() * m.Phi.transpose() + Q;
  if (!m.scale_at) return result;
  const Eigen::Matrix<double, kNavSize, 3> cross =
      m.Phi * P.block<kNavSize, kScaleSize>(0, *m.scale_at);
  const Eigen::Matrix<double, kNavSize, 9> added = cross * m.by_scale.transpose();
  result.leftCols<9>() += added;
  result.topRows<9>() += added.transpose();
  result.topLeftCorner<9, 9>() += m.by_scale *
                                  P.block<kScaleSize, kScaleSize>(*m.scale_at, *m.scale_at) *
                                  m.by_scale.transpose();
  return result;
}

}  // namespace

ImuIncrement integrate(const std::vector<ImuReading>& readings, const Vector3d& gyro_bias,
                       const Vector3d& accel_bias, const ImuNoise& noise,
                       const Vector3d& gyro_scale) {
  check(readings.size() >= 2, "an interval has two ends");
  ImuIncrement x;
  for (std::size_t i = 1; i < readings.size(); ++i) {
    step(x, readings[i - 1], readings[i], gyro_bias, accel_bias, noise, gyro_scale);
  }
  x.mean_rate /= x.dt;
  x.mean_force /= x.dt;
  return x;
}

Eigen::Quaterniond integrateRotation(const std::vector<ImuReading>& readings,
                                     const Vector3d& gyro_bias, const Vector3d& gyro_scale) {
  const auto rate = [&](const ImuReading& r) {
    return Vector3d((r.gyro - gyro_bias).cwiseQuotient(gyro_scale));
  };
  Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
  for (std::size_t i = 1; i < readings.size(); ++i) {
    const ImuReading &a = readings[i - 1], &b = readings[i];
    const Matrix3d R = expSo3(turned(rate(a), rate(b), toSeconds(b.time - a.time)));
    q = Eigen::Quaterniond(Matrix3d(q.toRotationMatrix() * R)).normalized();
  }
  return q;
}

RowMotion rowMotion(const Nav& nav, const ImuBuffer& imu, TimePoint time, Duration half,
                    double gravity, std::vector<ImuReading>& readings, const Vector3d& gyro_scale) {
  const double h = toSeconds(half);
  imu.between(time - half, time, readings);
  const Vector3d before = logSo3(integrateRotation(readings, nav.gyro_bias, gyro_scale));
  imu.between(time, time + half, readings);
  const Vector3d after = logSo3(integrateRotation(readings, nav.gyro_bias, gyro_scale));
  const Eigen::Quaterniond q_BW = nav.q_WB.conjugate();
  RowMotion m;
  m.rate = (before + after) / (2.0 * h);
  m.rate_change = (after - before) / (h * h);
  m.velocity = q_BW * nav.v_WB;
  m.acceleration = readings.front().accel - nav.accel_bias + q_BW * Vector3d(0, 0, -gravity);
  return m;
}

Nav predict(const Nav& nav, const ImuIncrement& x, double gravity) {
  const Vector3d g(0, 0, -gravity);
  Nav to = nav;
  to.q_WB = (nav.q_WB * x.dq).normalized();
  to.p_WB = nav.p_WB + nav.v_WB * x.dt + 0.5 * x.dt * x.dt * g + nav.q_WB * x.dp;
  to.v_WB = nav.v_WB + x.dt * g + nav.q_WB * x.dv;
  return to;
}

Matrix15d transition(const Nav& from, const Nav& to, const ImuIncrement& x, const Matrix3d& R_W_B0,
                     double gravity) {
  const Vector3d g(0, 0, -gravity);
  const Matrix3d R0 = from.q_WB.toRotationMatrix();
  Matrix15d Phi = x.F;
  Phi.block<3, 3>(kTheta, kTheta) = to.q_WB.toRotationMatrix().transpose() * R0;
  Phi.block<3, 3>(kPosition, kTheta) =
      -skew(to.p_WB - from.p_WB - from.v_WB * x.dt - 0.5 * x.dt * x.dt * g) * R0;
  Phi.block<3, 3>(kVelocity, kTheta) = -skew(to.v_WB - from.v_WB - x.dt * g) * R0;
  Phi.block<6, 6>(kPosition, kGyroBias) << R_W_B0 * x.F.block<3, 3>(kPosition, kGyroBias),
      R_W_B0 * x.F.block<3, 3>(kPosition, kAccelBias),
      R_W_B0 * x.F.block<3, 3>(kVelocity, kGyroBias),
      R_W_B0 * x.F.block<3, 3>(kVelocity, kAccelBias);
  return Phi;
}

void propagate(State& state, const ImuIncrement& x, TimePoint to, double gravity,
               bool first_estimates) {
  const Matrix3d R0 = state.nav.q_WB.toRotationMatrix();
  const Nav predicted = predict(state.nav, x, gravity);
  Nav from = state.nav, to_linear = predicted;
  if (first_estimates) {
    from = state.nav_linear;
    from.v_WB += std::min(1.0, x.dt / kFollow) * (state.nav.v_WB - from.v_WB);
    Nav turned = from;
    turned.q_WB = state.nav.q_WB;
    to_linear = predict(turned, x, gravity);
  }
  const Matrix15d Phi = transition(from, to_linear, x, R0, gravity);
  Matrix15d G = Matrix15d::Identity();
  G.block<3, 3>(kPosition, kPosition) = R0;
  G.block<3, 3>(kVelocity, kVelocity) = R0;

  Moves moves{Phi, x.by_scale, state.scaleAt()};
  moves.by_scale.middleRows<3>(kPosition) = R0 * x.by_scale.middleRows<3>(kPosition);
  moves.by_scale.middleRows<3>(kVelocity) = R0 * x.by_scale.middleRows<3>(kVelocity);

  auto P = state.P();
  const Eigen::Index rest = state.size() - kNavSize;
  const Matrix15d P_nav = movedNav(state, moves, G * x.Q * G.transpose());
  P.topLeftCorner<kNavSize, kNavSize>() = 0.5 * (P_nav + P_nav.transpose());
  // Multiplies in blocks of columns that fit on the stack.
  constexpr int kPiece = 32;
  for (Eigen::Index at = 0; at < rest; at += kPiece) {
    auto cross = P.block(0, kNavSize + at, kNavSize, std::min<Eigen::Index>(kPiece, rest - at));
    Eigen::Matrix<double, kNavSize, Eigen::Dynamic, Eigen::ColMajor, kNavSize, kPiece> moved =
        Phi * cross;
    if (moves.scale_at) {
      moved.topRows<9>().noalias() +=
          moves.by_scale * P.block(*moves.scale_at, kNavSize + at, kScaleSize, cross.cols());
    }
    cross = moved;
  }
  P.bottomLeftCorner(rest, kNavSize) = P.topRightCorner(kNavSize, rest).transpose();
  state.nav = predicted;
  state.nav_linear = to_linear;
  state.time = to;
}

}  // namespace perdure::vio
