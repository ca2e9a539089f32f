#include "common/mapping/graph/drift_scale.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <random>

namespace perdure::mapping {
namespace {

Eigen::Matrix4d deviations(double plane, double height, double yaw) {
  return Eigen::Vector4d(plane * plane, plane * plane, height * height, yaw * yaw).asDiagonal();
}

const Eigen::Matrix4d kMeasured = deviations(0.03, 0.02, 0.0005);

/// The odometry's covariance after some distance: the error of yaw has become one of position.
Eigen::Matrix4d odometryOf(std::mt19937& random) {
  std::uniform_real_distribution<double> any(0.5, 1.5);
  Eigen::Matrix4d P = deviations(0.4 * any(random), 0.2, 0.01);
  Eigen::Matrix4d J = Eigen::Matrix4d::Identity();
  J(0, 3) = -40.0 * any(random);
  J(1, 3) = 30.0 * any(random);
  return J * P * J.transpose();
}

DriftScale after(int loops, double scale, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  DriftScale drift({});
  for (int i = 0; i < loops; ++i) {
    const Eigen::Matrix4d odometry = odometryOf(random);
    const Eigen::Matrix4d all = kMeasured + scale * scale * odometry;
    Eigen::Vector4d standard;
    for (double& x : standard) x = normal(random);
    drift.add(all.llt().matrixL() * standard, kMeasured, odometry);
  }
  return drift;
}

TEST(DriftScale, ComesNearTheTrueOneByTwentyLoops) {
  for (const double scale : {0.1, 0.3, 1.0, 3.0}) {
    for (std::uint32_t seed = 1; seed <= 20; ++seed) {
      const double found = std::sqrt(after(20, scale, seed).variance().plane);
      EXPECT_GT(found, 0.5 * scale) << seed;
      EXPECT_LT(found, 2.0 * scale) << seed;
    }
  }
}

TEST(DriftScale, IsAnUpperQuantile) {
  for (const double scale : {0.3, 1.0, 2.0}) {
    int above = 0;
    for (std::uint32_t seed = 1; seed <= 200; ++seed) {
      if (after(3, scale, seed).variance().plane >= scale * scale) ++above;
    }
    // The grid and the prior raise the result above the quantile of .8.
    EXPECT_GT(above, 140) << scale;
    EXPECT_LT(above, 196) << scale;
  }
}

TEST(DriftScale, WithoutLoopsIsThePriorsQuantile) {
  // e^(.84 σ), minus the part that the grid cuts off, to within a step of the grid.
  EXPECT_NEAR(std::sqrt(DriftScale({}).variance().plane), 2.3, 0.3);
  DriftScaleParameters middle;
  middle.quantile = 0.5;
  EXPECT_NEAR(std::sqrt(DriftScale(middle).variance().height), 1.0, 0.15);
  DriftScaleParameters sure;
  sure.prior_sigma = 0.2;
  EXPECT_LT(DriftScale(sure).variance().plane, DriftScale({}).variance().plane);
}

TEST(DriftScale, ALoopThatMeasuresNothingTellsNothing) {
  DriftScale drift({});
  const DriftVariance before = drift.variance();
  std::mt19937 random(1);
  for (int i = 0; i < 20; ++i) {
    drift.add(Eigen::Vector4d::Zero(), 1e8 * deviations(1.0, 1.0, 1.0), odometryOf(random));
  }
  EXPECT_EQ(drift.variance(), before);
}

TEST(DriftScale, StaysWithinItsGrid) {
  DriftScale none({}), wild({});
  for (int i = 0; i < 200; ++i) {
    none.add(Eigen::Vector4d::Zero(), 1e-6 * deviations(1.0, 1.0, 1.0), deviations(1.0, 1.0, 0.1));
    wild.add({1e3, 1e3, 1e3, 3.0}, kMeasured, deviations(1.0, 1.0, 0.1));
  }
  EXPECT_GT(none.variance().plane, 0.0);
  EXPECT_LT(none.variance().plane, 0.01);
  EXPECT_NEAR(wild.variance().plane, 64.0, 1e-9);
  EXPECT_NEAR(wild.variance().height, 64.0, 1e-9);
}

TEST(DriftScale, AHeightThatDriftsTellsNothingOfThePlane) {
  DriftScale level({}), climbing({});
  for (int i = 0; i < 5; ++i) {
    level.add({0.3, 0.2, 0.2, 0.002}, kMeasured, deviations(1.0, 0.5, 0.01));
    climbing.add({0.3, 0.2, 3.0, 0.002}, kMeasured, deviations(1.0, 0.5, 0.01));
  }
  EXPECT_EQ(climbing.variance().plane, level.variance().plane);
  EXPECT_LT(climbing.variance().plane, 1.0);
  EXPECT_GT(climbing.variance().height, 16.0);
  const DriftVariance both{4.0, 9.0};
  const Eigen::Matrix4d P = both.of(Eigen::Matrix4d::Ones());
  EXPECT_EQ(P(0, 0), 4.0);
  EXPECT_EQ(P(2, 2), 9.0);
  EXPECT_EQ(P(2, 3), 6.0);
  EXPECT_EQ(both.over(both), DriftVariance());
}

}  // namespace
}  // namespace perdure::mapping
