#include "common/camera/wide_lens.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "common/camera/camera_model.h"
#include "common/math/numeric_jacobian.h"

namespace perdure {
namespace {

using Kind = WideLens::Kind;

// The parameters are close to those of TUM-VI's camera 0 (512 × 512, field of view 195 degrees).
WideLens lensOf(Kind kind) {
  switch (kind) {
    case Kind::kUnified:
      return {kind, 1.73, 0.0, 533.3, 533.3, 254.9, 256.9, {-0.1, 0.05, 2e-4, -1e-4}};
    case Kind::kExtendedUnified:
      return {kind, 0.632, 1.05, 191.2, 191.2, 254.9, 256.9, {}};
    default:
      return {kind, -0.2345, 0.5694, 156.68, 156.7, 254.9, 256.9, {}};
  }
}

CameraCalibration square() {
  CameraCalibration camera;
  camera.name = "cam0";
  camera.width = camera.height = 512;
  return camera;
}

class WideLenses : public ::testing::TestWithParam<Kind> {};

TEST_P(WideLenses, JacobianMatchesTheNumericOneAlsoBehindTheSide) {
  const WideLens lens = lensOf(GetParam());
  std::mt19937 random(5);
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  int tried = 0;
  for (int i = 0; i < 100; ++i) {
    const Eigen::Vector3d p(3 * u(random), 3 * u(random), 1.0 + 1.2 * u(random));
    Eigen::Matrix<double, 2, 3> J;
    if (!project(lens, p, &J)) continue;
    ++tried;
    const auto f = [&](const Eigen::VectorXd& x) -> Eigen::VectorXd {
      return *project(lens, Eigen::Vector3d(x));
    };
    EXPECT_LT((numericJacobian(f, p) - J).norm(), 1e-4 * J.norm());
  }
  EXPECT_GT(tried, 80);
}

TEST_P(WideLenses, AnEquidistantLensStandsForIt) {
  WideLens lens = lensOf(GetParam());
  CameraCalibration camera = square();
  const auto fit = fitEquidistant(lens, camera);
  ASSERT_TRUE(fit) << fit.error().detail;
  EXPECT_LT(fit->rms_px, 0.2);
  EXPECT_GT(fit->angle, 1.2);
  const CameraModel model(camera);
  for (double x = -2; x <= 2; x += 0.25) {
    for (double y = -2; y <= 2; y += 0.25) {
      const auto a = project(lens, {x, y, 1.0}), b = model.project({x, y, 1.0});
      ASSERT_TRUE(a && b);
      EXPECT_LT((*a - *b).norm(), fit->max_px + 0.05) << x << " " << y;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(All, WideLenses,
                         ::testing::Values(Kind::kUnified, Kind::kExtendedUnified,
                                           Kind::kDoubleSphere));

// Known points: with an xi or an alpha of zero, the model is a pinhole.
TEST(WideLens, WithoutASphereItIsAPinhole) {
  const Eigen::Vector3d p(0.4, -0.3, 2.0);
  const Eigen::Vector2d pinhole(100 + 50 * 0.2, 80 - 60 * 0.15);
  for (const Kind kind : {Kind::kUnified, Kind::kExtendedUnified, Kind::kDoubleSphere}) {
    const WideLens lens{kind, 0.0, kind == Kind::kExtendedUnified ? 1.0 : 0.0, 50, 60, 100, 80, {}};
    EXPECT_LT((*project(lens, p) - pinhole).norm(), 1e-12);
  }
  // Mei's model: with xi = 1, the point (.6, 0, .8) of the unit sphere projects to .6/1.8.
  const WideLens lens{Kind::kUnified, 1.0, 0.0, 90, 90, 0, 0, {}};
  EXPECT_NEAR(project(lens, {3, 0, 4})->x(), 30, 1e-12);
}

TEST(WideLens, WhatNoEquidistantLensFollowsIsRefused) {
  WideLens lens = lensOf(Kind::kUnified);
  lens.distortion = {0, 0, 0.02, 0.02};  // not symmetric about the axis
  CameraCalibration camera = square();
  const auto fit = fitEquidistant(lens, camera);
  ASSERT_FALSE(fit);
  EXPECT_THAT(fit.error().detail, ::testing::HasSubstr("calibrate it as pinhole-equi"));
  lens.cx = 1e5;
  EXPECT_FALSE(fitEquidistant(lens, camera));
}

}  // namespace
}  // namespace perdure
