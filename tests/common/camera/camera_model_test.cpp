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
  } else if (model == DistortionModel::kRational) {
    c.distortion_coefficients = {0.45, 0.09, 0.0007, -0.0004, 0.002, 0.72, 0.16, 0.008};
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
                                           DistortionModel::kEquidistant,
                                           DistortionModel::kRational));

TEST(CameraModel, WithoutItsLastFourCoefficientsTheRationalModelIsBrowns) {
  const CameraModel brown(calibrationWith(DistortionModel::kRadialTangential));
  CameraCalibration calibration = brown.calibration();
  calibration.distortion = DistortionModel::kRational;
  calibration.distortion_coefficients.resize(8, 0.0);
  const CameraModel rational(calibration);
  for (double x = -0.7; x < 0.7; x += 0.1) {
    const Eigen::Vector2d n(x, 0.4 - x);
    EXPECT_LT((brown.distort(n) - rational.distort(n)).norm(), 1e-12);
  }
}

TEST(CameraModel, TheRationalModelIsTheQuotientOfItsDefinition) {
  const CameraModel camera(calibrationWith(DistortionModel::kRational));
  const auto radial = [](double r2) {
    return (1 + r2 * (0.45 + r2 * (0.09 + r2 * 0.002))) /
           (1 + r2 * (0.72 + r2 * (0.16 + r2 * 0.008)));
  };
  const double x = 0.4, y = -0.3, r2 = 0.25, p1 = 0.0007, p2 = -0.0004;
  const Eigen::Vector2d expected(
      458.654 * (x * radial(r2) + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)) + 367.215,
      457.296 * (y * radial(r2) + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y) + 248.375);
  EXPECT_LT((camera.distort({x, y}) - expected).norm(), 1e-10);
}

TEST(CameraModel, DistortionThatFoldsBackDoesNotProjectFarPointsIntoTheImage) {
  CameraCalibration calibration = calibrationWith(DistortionModel::kRadialTangential);
  calibration.distortion_coefficients = {-0.3, 0.0, 0.0, 0.0};  // increases monotonically only up
                                                                // to r = 1.05
  const CameraModel camera(calibration);
  EXPECT_TRUE(camera.project({0.9, 0.0, 1.0}).has_value());
  EXPECT_FALSE(camera.project({1.8, 0.0, 1.0}).has_value());
}

}  // namespace
}  // namespace perdure
