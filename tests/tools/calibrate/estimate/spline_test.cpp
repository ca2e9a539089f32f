#include "tools/calibrate/estimate/spline.h"

#include <ceres/jet.h>
#include <ceres/manifold_test_utils.h>
#include <gtest/gtest.h>

#include "common/camera/camera_model.h"
#include "common/math/so3.h"
#include "common/sim/dice.h"
#include "tools/calibrate/estimate/camera_imu_costs.h"

namespace perdure::calibrate {
namespace {

Spline someSpline() {
  sim::Dice dice(7);
  const auto normal3 = [&] { return Eigen::Vector3d(dice.normal(), dice.normal(), dice.normal()); };
  Spline spline;
  spline.start_s = 2.0, spline.interval_s = 0.1;
  RigidTransform pose(expQuaternion(normal3()), normal3());
  for (int i = 0; i < 12; ++i) {
    spline.controls.push_back(pose);
    pose = RigidTransform(pose.q * expQuaternion(0.2 * normal3()), pose.p + 0.1 * normal3());
  }
  return spline;
}

using Q = Eigen::Map<const Eigen::Quaterniond>;
using P = Eigen::Map<const Eigen::Vector3d>;

TEST(Spline, RateAndAccelerationAreTheDerivativesOfThePose) {
  const Spline spline = someSpline();
  constexpr double kStep = 1e-4;
  for (double t = 2.013; t < spline.end_s() - 0.01; t += 0.037) {
    const std::size_t k = spline.segmentAt(t);
    const auto q = [&](std::size_t i) { return Q(spline.controls[k + i].q.coeffs().data()); };
    const auto p = [&](std::size_t i) { return P(spline.controls[k + i].p.data()); };
    const double u = spline.withinOf(k, t);
    const auto turning = rotationAt<double>({q(0), q(1), q(2), q(3), q(4)}, u, spline.interval_s);
    const auto acceleration =
        positionAt<double>({p(0), p(1), p(2), p(3), p(4)}, u, spline.interval_s, 2);
    const RigidTransform before = spline.poseAt(t - kStep), now = spline.poseAt(t),
                         after = spline.poseAt(t + kStep);
    const Eigen::Vector3d rate =
        logSo3(Eigen::Quaterniond(before.q.conjugate() * after.q)) / (2 * kStep);
    EXPECT_LT((rate - turning.rate).norm(), 1e-4) << t;
    const Eigen::Vector3d bent = (before.p - 2.0 * now.p + after.p) / (kStep * kStep);
    EXPECT_LT((bent - acceleration).norm(), 1e-4 * std::max(1.0, acceleration.norm())) << t;
  }
}

TEST(Spline, IsSmoothAcrossItsKnots) {
  const Spline spline = someSpline();
  for (std::size_t k = 1; k < spline.segments(); ++k) {
    const double t = spline.start_s + spline.interval_s * static_cast<double>(k);
    const auto before = spline.poseAt(t - 1e-9), after = spline.poseAt(t + 1e-9);
    EXPECT_LT(boxMinus(before, after).norm(), 1e-6) << k;
  }
}

TEST(Spline, HoldsAPoseThatAllItsControlsHave) {
  Spline spline = someSpline();
  for (auto& control : spline.controls) control = spline.controls[0];
  EXPECT_LT(boxMinus(spline.poseAt(2.33), spline.controls[0]).norm(), 1e-12);
}

TEST(Spline, LogAndExpHaveFiniteDerivativesAtZero) {
  using Jet = ceres::Jet<double, 3>;
  Vector3<Jet> theta(Jet(0.0, 0), Jet(0.0, 1), Jet(0.0, 2));
  const Vector3<Jet> again = logOf<Jet>(expQuaternionOf<Jet>(theta));
  for (int i = 0; i < 3; ++i) {
    EXPECT_LT((again[i].v - Eigen::Vector3d::Unit(i)).norm(), 1e-12);
  }
  for (const double size : {1e-7, 1e-5, 1e-3, 1.0, 3.0}) {
    const Eigen::Vector3d v = size * Eigen::Vector3d(0.6, -0.48, 0.64);
    EXPECT_LT((logOf<double>(expQuaternionOf<double>(v)) - v).norm(), 1e-12 * std::max(1.0, size));
  }
}

TEST(RightRotation, KeepsTheLawsOfAManifold) {
  using namespace ceres;  // required by the macro below
  const RightRotation manifold;
  const Eigen::Quaterniond q = expQuaternion({0.3, -1.0, 0.5}), other = expQuaternion({1, 0.2, -1});
  const ceres::Vector x = q.coeffs(), y = other.coeffs();
  for (const Eigen::Vector3d& step : {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(1e-3, 0, -2e-3),
                                      Eigen::Vector3d(0.4, 1.0, -0.3)}) {
    const ceres::Vector delta = step;
    EXPECT_THAT_MANIFOLD_INVARIANTS_HOLD(manifold, x, delta, y, 1e-6);
  }
}

TEST(ProjectPoint, IsTheProjectionOfTheServices) {
  for (const DistortionModel model : {DistortionModel::kNone, DistortionModel::kRadialTangential,
                                      DistortionModel::kEquidistant}) {
    CameraCalibration calibration;
    calibration.width = 640, calibration.height = 480;
    calibration.fx = 380, calibration.fy = 377, calibration.cx = 318, calibration.cy = 236;
    calibration.distortion = model;
    std::array<double, 4> d{};
    if (model != DistortionModel::kNone) d = {-0.1, 0.02, 3e-4, -2e-4};
    if (model != DistortionModel::kNone)
      calibration.distortion_coefficients.assign(d.begin(), d.end());
    const CameraModel camera(calibration);
    const std::array<double, 4> focal = {380, 377, 318, 236};
    for (double x = -0.8; x < 0.9; x += 0.2) {
      for (double y = -0.6; y < 0.7; y += 0.2) {
        const Eigen::Vector3d point(1.7 * x, 1.7 * y, 1.7);
        const auto expected = camera.project(point);
        ASSERT_TRUE(expected);
        const auto pixel = projectPoint<double>(model, focal.data(), d.data(), point);
        EXPECT_LT((pixel - *expected).norm(), 1e-9);
      }
    }
  }
}

}  // namespace
}  // namespace perdure::calibrate
