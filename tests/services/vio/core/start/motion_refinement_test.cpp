#include "services/vio/core/start/motion_refinement.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "common/math/gaussian.h"
#include "common/math/so3.h"
#include "services/vio/core/start/motion_initialiser.h"
#include "tests/services/vio/simulated_drive.h"

namespace perdure::vio {
namespace {

using Eigen::Vector3d;

constexpr double kPatience = 2.5;  // s

struct Attempt {
  Result<Start> start = fail("start_waits");
  Nav truth;  ///< there, with yaw 0
};

/// Images and samples begin `from` seconds into the drive; biases as far off as their priors say.
Attempt startIn(test::DrivePlace place, unsigned seed, double from) {
  std::mt19937 random(seed);
  std::normal_distribution<double> n;
  const Options options;
  test::DriveOptions o;
  o.place = place;
  o.seed = seed;
  o.gyro_bias = 0.05 * Vector3d(n(random), n(random), n(random));
  o.accel_bias = options.start.accel_bias_sigma * Vector3d(n(random), n(random), n(random));
  test::SimulatedDrive drive(o);
  ImuBuffer imu;
  for (const ImuReading& r : drive.imu(from + kPatience + 0.1)) {
    if (r.time < drive.time(from - 0.01)) continue;
    EXPECT_TRUE(imu.add(r));
  }
  MotionInitialiser initialiser(options);
  Attempt attempt;
  std::uint64_t frame = 0;
  for (double t = from; t < from + kPatience && !attempt.start; t += 0.05) {
    initialiser.add({++frame, drive.time(t), drive.see(t), {}, {}}, drive.time(t));
    attempt.start = initialiser.start(imu, drive.cameras());
    attempt.truth = drive.truth(t);
  }
  const Eigen::Quaterniond turn(rotationAboutZ(-yawOf(attempt.truth.q_WB.toRotationMatrix())));
  attempt.truth.q_WB = turn * attempt.truth.q_WB;
  attempt.truth.v_WB = turn * attempt.truth.v_WB;
  return attempt;
}

/// `beyond`: share on either side of the band in which the mean NEES has to lie.
void expectHonestStarts(int runs, double beyond) {
  int started = 0;
  double velocity = 0.0, tilt = 0.0, gyro = 0.0;
  for (int i = 1; i <= runs; ++i) {
    const Attempt a = startIn(test::DrivePlace::kRoom, static_cast<unsigned>(i), 1.0 + 0.4 * i);
    if (!a.start) continue;
    ++started;
    const Nav& nav = a.start->nav;
    const auto& P = a.start->covariance;
    velocity += squaredMahalanobis(a.truth.v_WB - nav.v_WB, P.block<3, 3>(kVelocity, kVelocity));
    gyro +=
        squaredMahalanobis(a.truth.gyro_bias - nav.gyro_bias, P.block<3, 3>(kGyroBias, kGyroBias));
    const Eigen::Matrix3d R = nav.q_WB.toRotationMatrix();
    const Vector3d turned = R * logSo3(nav.q_WB.conjugate() * a.truth.q_WB);
    const Eigen::Matrix3d of_turned = R * P.block<3, 3>(kTheta, kTheta) * R.transpose();
    tilt += squaredMahalanobis(Eigen::Vector2d(turned.head<2>()),
                               Eigen::Matrix2d(of_turned.topLeftCorner<2, 2>()));
  }
  EXPECT_GE(started, 0.8 * runs);
  const auto expectInBand = [&](const char* what, double sum, int dimensions) {
    const int dof = dimensions * started;
    const double low = chi2Quantile(beyond, dof), high = chi2Quantile(1.0 - beyond, dof);
    std::printf("%s %.2f (%.2f … %.2f)\n", what, sum / dof, low / dof, high / dof);
    EXPECT_GT(sum, low) << what;
    EXPECT_LT(sum, high) << what;
  };
  expectInBand("velocity", velocity, 3);
  expectInBand("tilt", tilt, 2);
  expectInBand("gyroscope bias", gyro, 3);
}

TEST(MotionRefinement, AFewStartsKnowHowWell) { expectHonestStarts(8, 5e-4); }
TEST(LongMotionRefinement, StartsKnowHowWell) { expectHonestStarts(40, 5e-3); }

TEST(MotionRefinement, GivesNoStartAtConstantVelocity) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    const Attempt a = startIn(test::DrivePlace::kStreet, seed, 2.0);
    ASSERT_FALSE(a.start) << seed;
    // The search found no minimum along the scale, or one that is too wide.
    EXPECT_THAT(a.start.error().code, testing::AnyOf("start_unobservable", "start_inconsistent"))
        << seed;
  }
}

TEST(MotionRefinement, DirectionsAcrossGravityAreAcrossItAndAsLong) {
  const Vector3d gravity(3.0, -2.0, -9.0);
  const auto B = acrossGravity(gravity);
  EXPECT_LT((B.transpose() * gravity).norm(), 1e-9);
  EXPECT_LT((B.transpose() * B - gravity.squaredNorm() * Eigen::Matrix2d::Identity()).norm(), 1e-9);
}

}  // namespace
}  // namespace perdure::vio
