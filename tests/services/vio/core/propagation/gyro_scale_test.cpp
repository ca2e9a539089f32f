// Tests the gyroscope's scale as a part of the state: its derivatives, its propagation in the
// covariance, its storage, and its estimation.
#include <gtest/gtest.h>

#include "common/math/numeric_jacobian.h"
#include "common/math/so3.h"
#include "services/vio/core/estimator.h"
#include "services/vio/core/propagation/imu_propagator.h"
#include "tests/services/vio/core/propagation/turning_readings.h"
#include "tests/services/vio/simulated_drive.h"

namespace perdure::vio {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;

const Vector3d kScale(1.04, 0.97, 1.02);

ImuIncrement scaledIncrement(const Nav& nav, const Vector3d& scale) {
  return integrate(test::turningReadings(), nav.gyro_bias, nav.accel_bias, ImuNoise{}, scale);
}

/// Difference of two states in [θ, p, v].
VectorXd poseDifference(const Nav& a, const Nav& b) {
  VectorXd d(9);
  d << logSo3(b.q_WB.conjugate() * a.q_WB), a.p_WB - b.p_WB, a.v_WB - b.v_WB;
  return d;
}

/// Derivative of [θ, p, v] at the end by [b_g, scale] at the start, by finite differences.
Eigen::MatrixXd numericByGyro(const Nav& nav) {
  const Nav reference = predict(nav, scaledIncrement(nav, kScale), 9.81);
  const auto f = [&](const VectorXd& d) -> VectorXd {
    Nav from = nav;
    from.gyro_bias += d.head<3>();
    return poseDifference(predict(from, scaledIncrement(from, kScale + d.tail<3>()), 9.81),
                          reference);
  };
  return numericJacobian(f, VectorXd::Zero(6), 1e-5);
}

TEST(GyroScale, DerivativesOfThePredictionAgreeWithNumericOnes) {
  const Nav nav = test::navInTheMiddle();
  const ImuIncrement x = scaledIncrement(nav, kScale);
  const Eigen::Matrix3d R = nav.q_WB.toRotationMatrix();
  Eigen::MatrixXd analytic(9, 6);
  analytic << x.F.block<9, 3>(0, kGyroBias), x.by_scale;
  analytic.bottomRows<6>() << R * analytic.middleRows<3>(3), R * analytic.bottomRows<3>();
  const Eigen::MatrixXd numeric = numericByGyro(nav);
  EXPECT_LT((numeric - analytic).cwiseAbs().maxCoeff(), 1e-6) << numeric - analytic;
}

TEST(GyroScale, AScaledReadingIsTheSameRate) {
  const Nav nav = test::navInTheMiddle();
  test::SimulatedDrive drive({});
  ImuBuffer plain, scaled;
  for (ImuReading r : drive.imu(1.0)) {
    ASSERT_TRUE(plain.add(r));
    r.gyro = nav.gyro_bias + kScale.cwiseProduct(r.gyro - nav.gyro_bias);
    ASSERT_TRUE(scaled.add(r));
  }
  const TimePoint from = drive.time(0.3), to = drive.time(0.5);
  const auto a = integrate(plain.between(from, to), nav.gyro_bias, nav.accel_bias, ImuNoise{});
  const auto b =
      integrate(scaled.between(from, to), nav.gyro_bias, nav.accel_bias, ImuNoise{}, kScale);
  EXPECT_LT(poseDifference(predict(nav, a, 9.81), predict(nav, b, 9.81)).norm(), 1e-12);
  EXPECT_LT((a.end_rate - b.end_rate).norm() + (a.mean_rate - b.mean_rate).norm(), 1e-12);
  const auto q = integrateRotation(scaled.between(from, to), nav.gyro_bias, kScale);
  EXPECT_LT(logSo3(a.dq.conjugate() * q).norm(), 1e-12);
  std::vector<ImuReading> memory;
  const Duration half = durationFromSeconds(0.01);
  const RowMotion rows = rowMotion(nav, plain, from, half, 9.81, memory);
  const RowMotion same = rowMotion(nav, scaled, from, half, 9.81, memory, kScale);
  EXPECT_LT((rows.rate - same.rate).norm(), 1e-12);
  EXPECT_LT((rows.rate_change - same.rate_change).norm(), 1e-9);
}

TEST(GyroScale, TheCovarianceFollowsTheDerivatives) {
  State state(std::vector<RigidTransform>(2), 0.0, 8, 4, {}, {.scale = true});
  state.nav = state.nav_linear = test::navInTheMiddle();
  state.gyro_scale = kScale;
  for (std::uint64_t frame = 1; frame <= 8; ++frame) {
    state.addClone(frame, fromNanoseconds(0), Vector3d::Zero(), false);
  }
  Eigen::MatrixXd A = Eigen::MatrixXd::Random(state.size(), state.size());
  state.P() = 1e-4 * (A * A.transpose() + Eigen::MatrixXd::Identity(A.rows(), A.cols()));
  const Eigen::MatrixXd before = state.P();
  const Nav from = state.nav;
  const ImuIncrement x = scaledIncrement(from, kScale);
  Eigen::MatrixXd Phi = Eigen::MatrixXd::Identity(state.size(), state.size());
  const Eigen::Matrix3d R = from.q_WB.toRotationMatrix();
  Phi.topLeftCorner<15, 15>() = transition(from, predict(from, x, 9.81), x, R, 9.81);
  Phi.block<9, 3>(0, *state.scaleAt()) = numericByGyro(from).rightCols<3>();
  Eigen::MatrixXd expected = Phi * before * Phi.transpose();
  Matrix15d G = Matrix15d::Identity();
  G.block<3, 3>(kPosition, kPosition) = G.block<3, 3>(kVelocity, kVelocity) = R;
  expected.topLeftCorner<15, 15>() += G * x.Q * G.transpose();
  propagate(state, x, fromNanoseconds(1), 9.81, false);
  EXPECT_LT((state.P() - expected).cwiseAbs().maxCoeff(), 1e-8);
}

TEST(GyroScale, IsInTheErrorOnlyWhereItIsEstimated) {
  const std::vector<RigidTransform> T_BC(1);
  EXPECT_FALSE(State(T_BC, 0.0, 3, 3).scaleAt());
  State state(T_BC, 0.0, 3, 3, {0.02}, {.readout = true, .scale = true});
  EXPECT_EQ(state.scaleAt(), state.timeOffsetAt() + 1);
  EXPECT_EQ(state.size(), state.calibrationEnd());
  VectorXd d = VectorXd::Zero(state.size());
  d.tail<3>() << 0.01, -0.02, 0.03;
  state.apply(d);
  EXPECT_EQ(state.gyro_scale, Vector3d(1.01, 0.98, 1.03));
}

Options estimatingScale(double sigma) {
  Options options;
  options.calibration.gyro_scale = sigma;
  return options;
}

TEST(GyroScale, ComesBackFromASavedStateWhereItIsEstimated) {
  test::SimulatedDrive drive({});
  Estimator with(estimatingScale(0.01), drive.T_BC(), 0.0), without(Options{}, drive.T_BC(), 0.0);
  with.start(test::startAt(drive, 0.2, 1, 1.0));
  EXPECT_DOUBLE_EQ(with.state().P()(22, 22), 1e-4);
  with.state().gyro_scale = kScale;
  const auto saved = fromText(toText(with.save()));
  ASSERT_TRUE(saved) << saved.error().detail;
  ASSERT_FALSE(without.fits(*saved));
  EXPECT_EQ(without.fits(*saved).error().code, "state_other_estimates");
  without.start(test::startAt(drive, 0.2, 1, 1.0));
  ASSERT_FALSE(with.fits(without.save()));
  EXPECT_EQ(with.fits(without.save()).error().code, "state_other_estimates");
  ASSERT_TRUE(with.fits(*saved));
  with.restore(*saved);
  EXPECT_EQ(with.state().gyro_scale, kScale);
  EXPECT_EQ(with.save().covariance, saved->covariance);
}

struct Found {
  Vector3d error, sigma;  ///< error of the scale at the end
};

/// Drives through a room for twenty seconds with a gyroscope of scale `scale`.
Found findScale(unsigned seed, const Vector3d& scale) {
  test::DriveOptions drive_options;
  drive_options.seed = seed;
  drive_options.gyro_scale = scale;
  test::SimulatedDrive drive(drive_options);
  ImuBuffer imu;
  for (const ImuReading& r : drive.imu(21.0)) EXPECT_TRUE(imu.add(r));
  Estimator estimator(estimatingScale(0.01), drive.T_BC(), 0.0);
  estimator.start(test::startAt(drive, 0.2, seed, 1.0));
  for (std::uint64_t frame = 1; frame <= 200; ++frame) {
    const double t = 0.2 + 0.1 * static_cast<double>(frame);
    const auto out = estimator.process({frame, drive.time(t), drive.see(t), {}, {}}, imu);
    EXPECT_TRUE(out) << out.error().code;
    if (!out) return {};
  }
  const State& state = estimator.state();
  const auto P = state.P();
  return {state.gyro_scale - scale,
          P.diagonal().segment<kScaleSize>(state.scaleAt().value()).cwiseSqrt()};
}

// Pitch and roll of the drive oscillate. Its yaw rate is constant, so that scale and bias about the
// vertical are not separable, and the covariance must show that.
TEST(GyroScale, IsFoundAboutTheAxesThatTurnToAndFro) {
  std::mt19937 random(5);
  std::normal_distribution<double> draw(1.0, 0.01);
  for (unsigned seed = 1; seed <= 4; ++seed) {
    const double x = draw(random), y = draw(random), z = draw(random);
    const Found found = findScale(seed, {x, y, z});
    for (int i = 0; i < 3; ++i) {
      EXPECT_LT(std::abs(found.error[i]), 3.0 * found.sigma[i]) << seed << ' ' << i;
      EXPECT_LT(found.sigma[i], i < 2 ? 0.001 : 0.006) << seed << ' ' << i;
    }
  }
}

}  // namespace
}  // namespace perdure::vio
