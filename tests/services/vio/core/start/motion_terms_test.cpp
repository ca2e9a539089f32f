#include "services/vio/core/start/motion_terms.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "common/math/so3.h"

namespace perdure::vio::motion {
namespace {

using Eigen::Index;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kStep = 1e-6;

TimePoint timeAt(double seconds) { return fromNanoseconds(std::llround(1e9 * seconds)); }

/// Three poses, a tenth of a second apart, that rotate and accelerate according to the samples.
/// Biases and a velocity are nonzero. Positions and velocities have small errors, so that the
/// residuals are nonzero.
struct Case {
  Case() {
    for (int k = 0; k <= 60; ++k) {
      const double t = 1.0 + 0.005 * k;
      ImuReading reading;
      reading.time = timeAt(t);
      reading.gyro = {0.4 * std::sin(7.0 * t), 0.6, -0.5 * std::cos(5.0 * t)};
      reading.accel = {1.2 * std::cos(6.0 * t), -0.7, 9.81 + 0.8 * std::sin(4.0 * t)};
      EXPECT_TRUE(imu.add(reading));
    }
    MotionWindow& w = estimate.window;
    w.gravity_B0 = 9.81 * Vector3d(0.1, -0.05, -1.0).normalized();
    w.gyro_bias = {0.03, -0.02, 0.05};
    w.accel_bias = {0.1, 0.05, -0.08};
    w.poses.resize(3);
    for (std::size_t i = 0; i < 3; ++i)
      w.poses[i].time = timeAt(1.0 + 0.1 * static_cast<double>(i));
    w.poses[0].v_B0 = {1.0, 0.4, -0.2};
    std::mt19937 random(5);
    std::normal_distribution<double> n(0.0, 0.02);
    const auto inertial = inertialOf(w, imu, Options{}.imu);
    for (std::size_t i = 0; i < 2; ++i) {
      const ImuIncrement& x = inertial->increments[i];
      const WindowPose& a = w.poses[i];
      WindowPose& b = w.poses[i + 1];
      b.R_B0_B = a.R_B0_B * x.dq.toRotationMatrix();
      b.p_B0 = a.p_B0 + a.v_B0 * x.dt + 0.5 * x.dt * x.dt * w.gravity_B0 + a.R_B0_B * x.dp;
      b.v_B0 = a.v_B0 + w.gravity_B0 * x.dt + a.R_B0_B * x.dv;
      b.p_B0 += Vector3d(n(random), n(random), n(random));
      b.v_B0 += Vector3d(n(random), n(random), n(random));
    }
    WindowPoint point;
    point.p_B0 = {0.5, -0.3, 4.0};
    for (std::size_t i = 0; i < 3; ++i) {
      WindowView view;
      view.keyframe = i;
      view.R_BC = expSo3(Vector3d(0.02, -0.05, 0.1));
      view.p_BC = {0.05, 0.02, -0.03};
      view.to_pixels << 460.0, 3.0, 0.0, 455.0;
      const WindowPose& pose = w.poses[i];
      const Vector3d p_B = pose.R_B0_B.transpose() * (point.p_B0 - pose.p_B0);
      const Vector3d p_C = view.R_BC.transpose() * (p_B - view.p_BC);
      view.normalised = p_C.hnormalized() + Eigen::Vector2d(n(random), n(random)) / 460.0;
      point.views.push_back(view);
    }
    w.points = {point};
    estimate.rays = raysOf(w);
  }
  MotionWindow moved(Index at, double by) const {
    MotionWindow w = estimate.window;
    VectorXd error = VectorXd::Zero(poseAt(w.poses.size()));
    error[at] = by;
    add(w, error);
    return w;
  }
  ImuBuffer imu;
  Estimate estimate;
};

TEST(MotionTerms, TheInertialJacobianAgreesWithTheNumericOne) {
  const Case c;
  const Index size = poseAt(3);
  const ImuNoise noise = Options{}.imu;
  const auto residualAt = [&](std::size_t i, Index at, double by) {
    const MotionWindow w = c.moved(at, by);
    // Biases change the readings, so that the readings are integrated again.
    return inertialResidual(w, i, inertialOf(w, c.imu, noise)->increments[i]);
  };
  const auto inertial = inertialOf(c.estimate.window, c.imu, noise);
  ASSERT_TRUE(inertial);
  for (std::size_t i = 0; i < 2; ++i) {
    const auto J = inertialJacobian(c.estimate.window, i, inertial->increments[i], size);
    EXPECT_GT(inertialResidual(c.estimate.window, i, inertial->increments[i]).norm(), 1e-3);
    for (Index at = 0; at < size; ++at) {
      const Vector9 numeric =
          (residualAt(i, at, kStep) - residualAt(i, at, -kStep)) / (2.0 * kStep);
      const double scale = std::max(1e-2, numeric.norm());
      EXPECT_LT((J.col(at) - numeric).norm(), 2e-3 * scale)
          << "increment " << i << ", entry " << at;
    }
  }
}

TEST(MotionTerms, TheViewsJacobiansAgreeWithNumericOnes) {
  const Case c;
  const auto inertial = inertialOf(c.estimate.window, c.imu, Options{}.imu);
  ASSERT_TRUE(inertial);
  const auto residual = [&](const Estimate& e, std::size_t view) {
    return viewTerm(e, 0, e.window.points[0].views[view], *inertial, 0.5)->r;
  };
  const auto difference = [&](std::size_t view, auto&& change) {
    Estimate more = c.estimate, less = c.estimate;
    change(more, kStep);
    change(less, -kStep);
    return Eigen::Vector2d((residual(more, view) - residual(less, view)) / (2.0 * kStep));
  };
  for (std::size_t view = 0; view < 3; ++view) {
    const auto term =
        viewTerm(c.estimate, 0, c.estimate.window.points[0].views[view], *inertial, 0.5);
    ASSERT_TRUE(term);
    const auto expectNear = [&](const Eigen::Vector2d& analytic, const Eigen::Vector2d& numeric,
                                const char* what, int entry) {
      EXPECT_LT((analytic - numeric).norm(), 1e-5 * std::max(1.0, numeric.norm()))
          << "view " << view << ", " << what << " " << entry;
    };
    for (int k = 0; k < 3; ++k) {
      expectNear(term->by_ray.col(k),
                 difference(view, [&](Estimate& e, double by) { e.rays[0].abr[k] += by; }), "ray",
                 k);
    }
    for (int k = 0; view > 0 && k < 6; ++k) {
      const auto turned = [&](Estimate& e, double by) { e.window = c.moved(poseAt(view) + k, by); };
      expectNear(term->by_pose.col(k), difference(view, turned), "pose", k);
    }
    const auto later = [&](Estimate& e, double by) { e.window.time_offset_s += by; };
    expectNear(term->by_offset, difference(view, later), "offset", 0);
  }
}

TEST(MotionTerms, GravityKeepsItsLength) {
  const Case c;
  for (const double by : {1e-3, 0.1, -0.4}) {
    EXPECT_NEAR(c.moved(kGravity, by).gravity_B0.norm(), 9.81, 1e-12) << by;
  }
}

}  // namespace
}  // namespace perdure::vio::motion
