#include "common/camera/camera_model.h"

#include <gtest/gtest.h>

#include <random>

#include "common/math/numeric_jacobian.h"

namespace perdure {
namespace {

CameraCalibration calibrationWith(DistortionModel model) {
  CameraCalibration c;
  c.name = "cam0";
  c.width = 752;
  c.height = 480;
  c.fx = 458.654;
  c.fy = 457.296;
  c.cx = 367.215;
  c.cy = 248.375;
  c.distortion = model;
  if (model == DistortionModel::kRadialTangential) {
    c.distortion_coefficients = {-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05};
  } else if (model == DistortionModel::kEquidistant) {
    c.distortion_coefficients = {-0.0143, 0.0048, -0.0031, 0.0007};
  }
  return c;
}

class CameraModelOfEachKind : public ::testing::TestWithParam<DistortionModel> {};

TEST_P(CameraModelOfEachKind, UnprojectInvertsProjectOverTheWholeImage) {
  const CameraModel camera(calibrationWith(GetParam()));
  for (double u = 5; u < camera.width(); u += 37) {
    for (double v = 5; v < camera.height(); v += 31) {
      const auto n = camera.unproject({u, v});
      ASSERT_TRUE(n.has_value());
      const auto pixel = camera.project({3 * n->x(), 3 * n->y(), 3});
      ASSERT_TRUE(pixel.has_value());
      EXPECT_LT((*pixel - Eigen::Vector2d(u, v)).norm(), 1e-5);
    }
  }
}

TEST_P(CameraModelOfEachKind, JacobianMatchesTheNumericOne) {
  const CameraModel camera(calibrationWith(GetParam()));
  std::mt19937 random(7);
  std::uniform_real_distribution<double> u(-0.5, 0.5);
  for (int i = 0; i < 50; ++i) {
    const Eigen::Vector3d p(4 * u(random), 3 * u(random), 4.0 + 2 * u(random));
    Eigen::Matrix<double, 2, 3> J;
    ASSERT_TRUE(camera.project(p, &J).has_value());
    const auto f = [&](const Eigen::VectorXd& x) -> Eigen::VectorXd {
      return *camera.project(Eigen::Vector3d(x));
    };
    EXPECT_LT((numericJacobian(f, p) - J).norm(), 1e-4 * J.norm());
  }
}

TEST_P(CameraModelOfEachKind, PointsBehindDoNotProject) {
  const CameraModel camera(calibrationWith(GetParam()));
  EXPECT_FALSE(camera.project({0.1, 0.1, -2.0}).has_value());
  EXPECT_FALSE(camera.project({0.1, 0.1, 0.0}).has_value());
}

INSTANTIATE_TEST_SUITE_P(Models, CameraModelOfEachKind,
                         ::testing::Values(DistortionModel::kNone,
                                           DistortionModel::kRadialTangential,
                                           DistortionModel::kEquidistant));

TEST(CameraModel, DistortionThatFoldsBackDoesNotProjectFarPointsIntoTheImage) {
  CameraCalibration calibration = calibrationWith(DistortionModel::kRadialTangential);
  calibration.distortion_coefficients = {-0.3, 0.0, 0.0, 0.0};  // grows up to r = 1.05 only
  const CameraModel camera(calibration);
  EXPECT_TRUE(camera.project({0.9, 0.0, 1.0}).has_value());
  EXPECT_FALSE(camera.project({1.8, 0.0, 1.0}).has_value());
}

}  // namespace
}  // namespace perdure
