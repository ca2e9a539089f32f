#include "services/vio/core/update/updates.h"

#include <algorithm>
#include <cmath>

#include "common/base/check.h"
#include "common/math/so3.h"
#include "services/vio/core/update/visual.h"

namespace perdure::vio {

using Eigen::Matrix3d;
using Eigen::Vector3d;

Vector3d bodyVelocity(const Nav& nav, Eigen::Matrix<double, 3, 6>* J) {
  const Matrix3d R_BW = nav.q_WB.toRotationMatrix().transpose();
  const Vector3d v_B = R_BW * nav.v_WB;
  if (J) *J << skew(v_B), R_BW;
  return v_B;
}

Result<void> updateSpeed(State& state, double speed, double sigma, const SpeedOptions& options) {
  Eigen::Matrix<double, 3, 6> J;
  const Vector3d v_B = bodyVelocity(state.nav, &J);
  const int rows = options.planar ? 3 : 1;
  const Vector3d sigmas(std::max(sigma * options.sigma_factor, options.min_sigma),
                        options.lateral_sigma, options.vertical_sigma);
  const Vector3d weights = sigmas.cwiseInverse();
  const Eigen::VectorXd r = ((Vector3d(speed, 0, 0) - v_B).cwiseProduct(weights)).head(rows);
  const Eigen::MatrixXd H = (weights.asDiagonal() * J).topRows(rows);
  const std::vector<Block> blocks{{kTheta, 3}, {kVelocity, 3}};
  const Eigen::MatrixXd S = state.project(H, blocks) + Eigen::MatrixXd::Identity(rows, rows);
  if (!passesGate(r, S, 0.9999)) return fail("speed_gated");
  return state.update(H, blocks, r);
}

RestSample restSample(const std::vector<ImuReading>& readings, const ImuNoise& noise) {
  check(readings.size() >= 2, "an interval has two ends");
  RestSample s{Vector3d::Zero(), Vector3d::Zero(), 0.0, 0.0};
  const double n = static_cast<double>(readings.size());
  for (const ImuReading& r : readings) {
    s.rate += r.gyro / n;
    s.force += r.accel / n;
  }
  double rate2 = 0.0, force2 = 0.0;
  for (const ImuReading& r : readings) {
    rate2 += (r.gyro - s.rate).squaredNorm() / 3.0;
    force2 += (r.accel - s.force).squaredNorm() / 3.0;
  }
  const double dt = toSeconds(readings.back().time - readings.front().time);
  // Vibration is not white. The mean is therefore as accurate as that of a quarter of the samples.
  const double credit = std::max(1.0, n / 4.0) * (n - 1.0);
  s.rate_sigma = std::sqrt(noise.gyro * noise.gyro / dt + rate2 / credit);
  s.force_sigma = std::sqrt(noise.accel * noise.accel / dt + force2 / credit);
  return s;
}

Eigen::Matrix<double, 6, 1> restPrediction(const Nav& nav, double gravity,
                                           Eigen::Matrix<double, 6, 9>* J) {
  const Vector3d up_B = nav.q_WB.conjugate() * Vector3d(0, 0, gravity);
  if (J) {
    J->setZero();
    J->block<3, 3>(0, 3).setIdentity();
    J->block<3, 3>(3, 0) = skew(up_B);
    J->block<3, 3>(3, 6).setIdentity();
  }
  Eigen::Matrix<double, 6, 1> z;
  z << nav.gyro_bias, up_B + nav.accel_bias;
  return z;
}

Result<void> updateRest(State& state, const RestSample& s, const RestOptions& options,
                        double gravity, bool gated) {
  Eigen::Matrix<double, 6, 9> J;
  const Eigen::Matrix<double, 6, 1> z = restPrediction(state.nav, gravity, &J);
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(9, 12);  // [θ, v, b_g, b_a]
  Eigen::VectorXd r(9);
  r << -state.nav.v_WB / options.speed_sigma, (s.rate - z.head<3>()) / s.rate_sigma,
      (s.force - z.tail<3>()) / s.force_sigma;
  H.block<3, 3>(0, 3) = Matrix3d::Identity() / options.speed_sigma;
  H.block<3, 3>(3, 0) = J.block<3, 3>(0, 0) / s.rate_sigma;
  H.block<3, 6>(3, 6) = J.block<3, 6>(0, 3) / s.rate_sigma;
  H.block<3, 3>(6, 0) = J.block<3, 3>(3, 0) / s.force_sigma;
  H.block<3, 6>(6, 6) = J.block<3, 6>(3, 3) / s.force_sigma;
  const std::vector<Block> blocks{{kTheta, 3}, {kVelocity, 3}, {kGyroBias, 6}};
  const Eigen::MatrixXd S = state.project(H, blocks) + Eigen::MatrixXd::Identity(9, 9);
  if (gated && !passesGate(r, S, 0.9999)) return fail("rest_gated");
  return state.update(H, blocks, r);
}

Result<void> updateNoMotion(State& state, std::uint64_t before, std::uint64_t frame,
                            const RestOptions& options) {
  const Clone *a = state.clone(before), *b = state.clone(frame);
  check(a && b, "both clones are in the state");
  // Log(R_aᵀ R_b) ≈ θ_b − R_bᵀ R_a θ_a for small rotations between them.
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(6, 12);
  Eigen::VectorXd r(6);
  const double wr = 1.0 / options.rotation_sigma, wp = 1.0 / options.position_sigma_m;
  const Vector3d phi = logSo3(a->T_WB.q.conjugate() * b->T_WB.q);
  const Matrix3d J_inverse = rightJacobianInverseSo3(phi);
  r << -wr * phi, wp * (a->T_WB.p - b->T_WB.p);
  H.block<3, 3>(0, 0) = -wr * J_inverse * (b->T_WB.q.conjugate() * a->T_WB.q).toRotationMatrix();
  H.block<3, 3>(0, 6) = wr * J_inverse;
  H.block<3, 3>(3, 3) = -wp * Matrix3d::Identity();
  H.block<3, 3>(3, 9) = wp * Matrix3d::Identity();
  return state.update(H, {{a->at, 6}, {b->at, 6}}, r);
}

}  // namespace perdure::vio
