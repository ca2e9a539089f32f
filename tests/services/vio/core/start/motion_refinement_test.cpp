#include "services/vio/core/start/motion_refinement.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <random>

#include "common/math/chi2.h"
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
  Nav truth;  ///< true state at the time of the start, with yaw 0
};

/// Images and samples begin `from` seconds into the drive; biases are drawn from their priors.
/// `noise` scales the samples' noise relative to the options.
Attempt startIn(test::DrivePlace place, unsigned seed, double from, double noise = 1.0,
                double camera_ahead_m = 0.0) {
  std::mt19937 random(seed);
  std::normal_distribution<double> n;
  const Options options;
  test::DriveOptions o;
  o.place = place;
  o.seed = seed;
  o.camera_ahead_m = camera_ahead_m;
  o.noise.gyro *= noise;
  o.noise.accel *= noise;
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

/// `beyond`: probability on either side of the band in which the mean NEES must be.
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

// A vibrating airframe: the few rows of the samples must have an effect beside the many rows of the
// images.
TEST(MotionRefinement, SamplesThatFitBadlyWidenTheStart) {
  int started = 0;
  double nees = 0.0;
  for (unsigned seed = 1; seed <= 8; ++seed) {
    const Attempt a = startIn(test::DrivePlace::kRoom, seed, 1.0 + 0.4 * seed, 10.0);
    if (!a.start) continue;
    ++started;
    nees += squaredMahalanobis(a.truth.v_WB - a.start->nav.v_WB,
                               a.start->covariance.block<3, 3>(kVelocity, kVelocity));
  }
  ASSERT_GE(started, 6);
  std::printf("%d starts, velocity's NEES %.2f of 1\n", started, nees / (3 * started));
  EXPECT_LT(nees / (3 * started), 3.0);
}

TEST(MotionRefinement, GivesNoStartAtConstantVelocity) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    const Attempt a = startIn(test::DrivePlace::kStreet, seed, 2.0);
    ASSERT_FALSE(a.start) << seed;
    // The search found no minimum along the scale, or only a wide one.
    EXPECT_THAT(a.start.error().code, testing::AnyOf("start_unobservable", "start_inconsistent"))
        << seed;
  }
}

// A short window has two explanations: a camera that rests while the body orbits it, and the truth,
// in which the body rests and the camera orbits.
TEST(MotionRefinement, GivesNoWrongStartWhereACameraFarFromTheBodyTurns) {
  for (const unsigned seed : {2u, 3u, 18u, 26u, 27u}) {
    const Attempt a = startIn(test::DrivePlace::kSpot, seed, 1.0 + 0.3 * seed, 1.0, 2.0);
    if (!a.start) continue;
    const double error = (a.truth.v_WB - a.start->nav.v_WB).norm();
    const double sigma = std::sqrt(a.start->covariance.block<3, 3>(kVelocity, kVelocity).trace());
    EXPECT_LT(error, 3.0 * sigma) << seed;
  }
}

/// A window of eight keyframes in the room, with true poses and points.
struct TrueWindow {
  MotionWindow window;
  ImuBuffer imu;
};

TrueWindow trueWindow() {
  test::DriveOptions o;
  o.place = test::DrivePlace::kRoom;
  test::SimulatedDrive drive(o);
  TrueWindow w;
  for (const ImuReading& r : drive.imu(3.0)) EXPECT_TRUE(w.imu.add(r));
  const CameraModel& camera = drive.cameras()[0];
  const Nav first = drive.truth(1.0);
  const Eigen::Quaterniond to_B0 = first.q_WB.conjugate();
  std::map<std::uint64_t, WindowPoint> points;
  for (std::size_t k = 0; k < 8; ++k) {
    const double t = 1.0 + 0.1 * static_cast<double>(k);
    const Nav nav = drive.truth(t);
    w.window.poses.push_back({drive.time(t), (to_B0 * nav.q_WB).toRotationMatrix(),
                              to_B0 * (nav.p_WB - first.p_WB), to_B0 * nav.v_WB});
    for (const TrackedPoint& p : drive.see(t).points) {
      if (!p.seen[0]) continue;
      points[p.id].views.push_back({k, camera.T_BC().R(), camera.T_BC().p, p.seen[0]->normalised,
                                    p.seen[0]->to_pixels, 0.0});
    }
  }
  w.window.gravity_B0 = to_B0 * Vector3d(0, 0, -Options{}.gravity);
  w.window.gyro_bias = first.gyro_bias;
  for (auto& [id, point] : points) {
    const WindowView& v = point.views.front();
    const WindowPose& pose = w.window.poses[v.keyframe];
    point.p_B0 = pose.p_B0 + pose.R_B0_B * (v.p_BC + 2.0 * (v.R_BC * v.normalised.homogeneous()));
    if (point.views.size() >= 3) w.window.points.push_back(point);
  }
  return w;
}

TEST(MotionRefinement, FindsTheScaleFromFarOff) {
  const TrueWindow w = trueWindow();
  const auto best = refine(w.window, w.imu, Options{});
  ASSERT_TRUE(best) << best.error().code;
  for (const double scale : {0.2, 5.0}) {
    MotionWindow window = w.window;
    for (WindowPose& pose : window.poses) {
      pose.p_B0 *= scale;
      pose.v_B0 *= scale;
    }
    for (WindowPoint& point : window.points) point.p_B0 *= scale;
    const auto minimum = refine(std::move(window), w.imu, Options{});
    ASSERT_TRUE(minimum) << scale << ": " << minimum.error().code;
    EXPECT_NEAR(minimum->cost, best->cost, 1.0) << scale;
  }
}

// If the body's x axis points up, its yaw is undefined and must not determine the rotation of W.
TEST(MotionRefinement, WIsNotTurnedByAnErrorOfTilt) {
  for (unsigned seed = 1; seed <= 3; ++seed) {
    const Attempt a = startIn(test::DrivePlace::kRoom, seed, 1.0 + 0.4 * seed);
    ASSERT_TRUE(a.start);
    const Eigen::Matrix3d R = a.start->nav.q_WB.toRotationMatrix();
    const Eigen::Matrix3d in_W =
        R * a.start->covariance.block<3, 3>(kTheta, kTheta) * R.transpose();
    EXPECT_LT(std::sqrt(in_W(2, 2)), 2e-4) << seed;
    EXPECT_GT(std::sqrt(in_W(0, 0)), 1e-3) << seed;
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
