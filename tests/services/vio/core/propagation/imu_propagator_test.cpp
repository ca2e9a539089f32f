#include "services/vio/core/propagation/imu_propagator.h"

#include <gtest/gtest.h>

#include "common/math/numeric_jacobian.h"
#include "common/math/so3.h"
#include "tests/services/vio/core/propagation/turning_readings.h"
#include "tests/services/vio/simulated_drive.h"

namespace perdure::vio {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;

Nav perturbed(const Nav& nav, const VectorXd& d) {
  Nav n = nav;
  n.q_WB = nav.q_WB * expQuaternion(d.segment<3>(kTheta));
  n.p_WB += d.segment<3>(kPosition);
  n.v_WB += d.segment<3>(kVelocity);
  n.gyro_bias += d.segment<3>(kGyroBias);
  n.accel_bias += d.segment<3>(kAccelBias);
  return n;
}

VectorXd difference(const Nav& a, const Nav& b) {
  VectorXd d(15);
  d << logSo3(b.q_WB.conjugate() * a.q_WB), a.p_WB - b.p_WB, a.v_WB - b.v_WB,
      a.gyro_bias - b.gyro_bias, a.accel_bias - b.accel_bias;
  return d;
}

TEST(ImuPropagator, PredictsTheAnalyticTrajectoryWithinTolerance) {
  test::DriveOptions options;
  options.noise.gyro = options.noise.accel = 0.0;
  test::SimulatedDrive drive(options);
  ImuBuffer buffer;
  for (const ImuReading& r : drive.imu(5.2)) ASSERT_TRUE(buffer.add(r));
  Nav nav = drive.truth(0.1);
  const ImuIncrement x = integrate(buffer.between(drive.time(0.1), drive.time(5.1)), nav.gyro_bias,
                                   nav.accel_bias, ImuNoise{});
  const Nav end = predict(nav, x, 9.81), truth = drive.truth(5.1);
  EXPECT_NEAR(x.dt, 5.0, 1e-9);
  EXPECT_LT(logSo3(truth.q_WB.conjugate() * end.q_WB).norm(), 2e-5);
  EXPECT_LT((truth.v_WB - end.v_WB).norm(), 3e-4);
  EXPECT_LT((truth.p_WB - end.p_WB).norm(), 1e-3);
}

TEST(ImuPropagator, TransitionIsTheDerivativeOfThePrediction) {
  const auto readings = test::turningReadings();
  const Nav nav = test::navInTheMiddle();
  const auto end = [&](const Nav& from) {
    return predict(from, integrate(readings, from.gyro_bias, from.accel_bias, ImuNoise{}), 9.81);
  };
  const Nav reference = end(nav);
  const auto f = [&](const VectorXd& d) -> VectorXd {
    return difference(end(perturbed(nav, d)), reference);
  };
  const Eigen::MatrixXd numeric = numericJacobian(f, VectorXd::Zero(15), 1e-5);
  const ImuIncrement x = integrate(readings, nav.gyro_bias, nav.accel_bias, ImuNoise{});
  const Matrix15d analytic = transition(nav, reference, x, nav.q_WB.toRotationMatrix(), 9.81);
  EXPECT_LT((numeric - analytic).cwiseAbs().maxCoeff(), 1e-6) << numeric - analytic;
}

TEST(ImuPropagator, NoiseCovarianceMatchesMonteCarlo) {
  const Nav nav = test::navInTheMiddle();
  ImuNoise noise;
  noise.gyro = 0.01;
  noise.accel = 0.05;
  noise.gyro_walk = noise.accel_walk = 0.0;
  noise.interpolation_from_s = 1.0;
  std::vector<ImuReading> readings;
  for (int i = 0; i <= 100; ++i) {
    const double t = 0.005 * i;
    readings.push_back({fromNanoseconds(0) + durationFromSeconds(t), Vector3d(0.4, -0.9, 0.6),
                        Vector3d(1.0, 9.0, 2.0 + t)});
  }
  const ImuIncrement mean = integrate(readings, nav.gyro_bias, nav.accel_bias, noise);
  const Nav reference = predict(nav, mean, 9.81);
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  const auto draw = [&](double s) {
    return Vector3d(s * normal(random), s * normal(random), s * normal(random));
  };
  Eigen::Matrix<double, 9, 9> sum = Eigen::Matrix<double, 9, 9>::Zero();
  constexpr int kRuns = 3000;
  for (int run = 0; run < kRuns; ++run) {
    auto noisy = readings;
    for (ImuReading& r : noisy) {
      r.gyro += draw(noise.gyro / std::sqrt(0.005));
      r.accel += draw(noise.accel / std::sqrt(0.005));
    }
    const Nav end = predict(nav, integrate(noisy, nav.gyro_bias, nav.accel_bias, noise), 9.81);
    const VectorXd d = difference(end, reference).head(9);
    sum += d * d.transpose() / kRuns;
  }
  const Eigen::Matrix3d R = nav.q_WB.toRotationMatrix();
  Eigen::Matrix<double, 9, 9> G = Eigen::Matrix<double, 9, 9>::Identity();
  G.block<3, 3>(3, 3) = R;
  G.block<3, 3>(6, 6) = R;
  const Eigen::Matrix<double, 9, 9> Q = G * mean.Q.topLeftCorner<9, 9>() * G.transpose();
  for (int i = 0; i < 9; ++i) EXPECT_NEAR(sum(i, i) / Q(i, i), 1.0, 0.12) << i;
}

TEST(ImuPropagator, SparseSamplesAreTrustedLess) {
  auto readings = test::turningReadings();
  ImuNoise noise;
  noise.interpolation_from_s = 1.0;
  const double dense = integrate(readings, Vector3d::Zero(), Vector3d::Zero(), noise).Q(6, 6);
  noise.interpolation_from_s = 0.01;
  const double sparse = integrate(readings, Vector3d::Zero(), Vector3d::Zero(), noise).Q(6, 6);
  EXPECT_GT(sparse, 10.0 * dense);
}

TEST(ImuBuffer, InterpolatesAtTheEndsAndHoldsBeyondThem) {
  ImuBuffer buffer;
  for (int i = 0; i < 5; ++i) {
    ASSERT_TRUE(buffer.add({fromNanoseconds(10 * i), Vector3d(i, 0, 0), Vector3d(0, i, 0)}));
  }
  const auto r = buffer.between(fromNanoseconds(15), fromNanoseconds(34));
  ASSERT_EQ(r.size(), 4u);
  EXPECT_NEAR(r.front().gyro.x(), 1.5, 1e-12);
  EXPECT_NEAR(r.back().accel.y(), 3.4, 1e-12);
  EXPECT_NEAR(buffer.between(fromNanoseconds(35), fromNanoseconds(60)).back().gyro.x(), 4.0, 0.0);
}

TEST(ImuBuffer, RefusesWhatIsDoubledOutOfOrderOrNotFinite) {
  ImuBuffer buffer;
  ASSERT_TRUE(buffer.add({fromNanoseconds(10), Vector3d::Zero(), Vector3d::Zero()}));
  EXPECT_EQ(buffer.add({fromNanoseconds(10), Vector3d::Zero(), Vector3d::Zero()}).error().code,
            "imu_duplicate");
  EXPECT_EQ(buffer.add({fromNanoseconds(5), Vector3d::Zero(), Vector3d::Zero()}).error().code,
            "imu_out_of_order");
  EXPECT_EQ(
      buffer.add({fromNanoseconds(20), Vector3d::Constant(NAN), Vector3d::Zero()}).error().code,
      "imu_not_finite");
}

TEST(ImuBuffer, InterpolatesOverWhatIsSaturated) {
  ImuBuffer buffer;
  const auto ms = [](double t) { return fromNanoseconds(static_cast<std::int64_t>(1e6 * t)); };
  int saturated = 0;
  for (int i = 0; i <= 100; i += 5) {
    const double x = 0.1 * i, limit = 19.6;
    const bool high = i >= 30 && i < 60;
    const auto added = buffer.add({ms(i), Vector3d(x, 0, 0), Vector3d(high ? limit : x, 0, 9.81)});
    saturated += !added && added.error().code == "imu_accel_saturated";
  }
  EXPECT_EQ(saturated, 5);
  for (const ImuReading& r : buffer.between(ms(12), ms(87))) {
    const double x = 1e2 * toSeconds(r.time - ms(0));
    EXPECT_NEAR(r.gyro.x(), x, 1e-9);
    EXPECT_NEAR(r.accel.x(), x, 1e-9);
    const bool over = x > 2.5 + 1e-9 && x < 6.0 + 1e-9;
    EXPECT_NEAR(r.accel_span_s, over ? 0.035 : 0.005, 1e-9) << x;
    EXPECT_NEAR(r.gyro_span_s, 0.005, 1e-9);
  }
}

TEST(Propagation, AGapIsAsUncertainInPiecesAsInOne) {
  ImuBuffer buffer;
  const auto ms = [](int t) { return fromNanoseconds(1'000'000LL * t); };
  for (const int t : {0, 5, 10, 510, 515}) {
    ASSERT_TRUE(buffer.add({ms(t), Vector3d::Zero(), Vector3d(0, 0, 9.81)}));
  }
  const ImuNoise noise;
  const auto sigma = [&](int from, int to) {
    return integrate(buffer.between(ms(from), ms(to)), Vector3d::Zero(), Vector3d::Zero(), noise)
        .Q(kVelocity, kVelocity);
  };
  EXPECT_NEAR(std::sqrt(sigma(10, 510)), 0.5 * noise.gap_accel, 0.01);
  double pieces = 0.0;
  for (int t = 10; t < 510; t += 50) pieces += sigma(t, t + 50);
  EXPECT_NEAR(pieces, sigma(10, 510), 0.01 * pieces);
}

TEST(ImuBuffer, FindsTheLongestGap) {
  ImuBuffer buffer;
  for (const int t : {0, 10, 20, 70, 80}) {
    ASSERT_TRUE(buffer.add({fromNanoseconds(t), Vector3d::Zero(), Vector3d::Zero()}));
  }
  EXPECT_EQ(buffer.longestGap(fromNanoseconds(5), fromNanoseconds(40)), Duration(50));
  EXPECT_EQ(buffer.longestGap(fromNanoseconds(5), fromNanoseconds(18)), Duration(10));
}

}  // namespace
}  // namespace perdure::vio
