#include "common/mapping/fusion/covariance_intersection.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <numbers>
#include <random>

#include "common/math/gaussian.h"

namespace perdure::mapping {
namespace {

class Draws {
 public:
  explicit Draws(std::uint32_t seed) : random_(seed) {}
  double normal() { return std::normal_distribution<double>()(random_); }
  Vector7d vector() {
    return Vector7d::NullaryExpr([this] { return normal(); });
  }
  Matrix7d covariance() {
    const Matrix7d root = Matrix7d::NullaryExpr([this] { return normal(); });
    return 0.02 * (root * root.transpose() + 0.2 * Matrix7d::Identity());
  }
  CuboidGaussian gaussian() {
    CuboidGaussian g{vector(), covariance()};
    g.mean[3] = std::fmod(g.mean[3], 1.5);
    return g;
  }

 private:
  std::mt19937 random_;
};

/// Largest eigenvalue of the true error covariance relative to the claimed one.
double boast(const Matrix7d& errors, const Matrix7d& claimed) {
  const Matrix7d L = claimed.llt().matrixL();
  const Matrix7d half = L.triangularView<Eigen::Lower>().solve(errors);
  Matrix7d white = L.triangularView<Eigen::Lower>().solve(half.transpose());
  makeSymmetric(white);
  return eigenvalues(white).maxCoeff();
}

TEST(CovarianceIntersection, OfAThingWithItselfIsItself) {
  Draws draws(1);
  for (int i = 0; i < 50; ++i) {
    const CuboidGaussian a = draws.gaussian();
    const double w = intersectionWeight(a.covariance, a.covariance);
    EXPECT_EQ(w, 0.5);
    const CuboidGaussian same = intersect(a, a, w);
    EXPECT_TRUE(same.mean.isApprox(a.mean, 1e-12));
    EXPECT_TRUE(same.covariance.isApprox(a.covariance, 1e-9));
  }
}

TEST(CovarianceIntersection, IsTheSameInEitherOrder) {
  Draws draws(2);
  for (int i = 0; i < 50; ++i) {
    const CuboidGaussian a = draws.gaussian();
    CuboidGaussian b = draws.gaussian();
    b.mean = a.mean + 0.1 * draws.vector();
    const double w = intersectionWeight(a.covariance, b.covariance);
    EXPECT_NEAR(w, 1.0 - intersectionWeight(b.covariance, a.covariance), 1e-9);
    const CuboidGaussian ab = intersect(a, b, w), ba = intersect(b, a, 1.0 - w);
    EXPECT_TRUE(ab.mean.isApprox(ba.mean, 1e-7));
    EXPECT_TRUE(ab.covariance.isApprox(ba.covariance, 1e-7));
  }
}

TEST(CovarianceIntersection, HasTheLeastVolumeOfAllWeights) {
  Draws draws(3);
  for (int i = 0; i < 20; ++i) {
    CuboidGaussian a = draws.gaussian(), b = draws.gaussian();
    b.mean = a.mean;
    const auto volume = [&](double w) {
      return std::log(intersect(a, b, w).covariance.determinant());
    };
    const double best = volume(intersectionWeight(a.covariance, b.covariance));
    for (double w = 0.0; w <= 1.0; w += 0.05) EXPECT_LE(best, volume(w) + 1e-9) << w;
  }
}

/// The errors have an unknown common part. The claim must hold for any such part. A claim that
/// assumes independent errors does not.
TEST(CovarianceIntersection, ClaimsNoMoreThanIsTrueUnderUnknownCorrelation) {
  Draws draws(4);
  double naive_boast = 0.0;
  for (const double correlation : {-1.0, 0.0, 0.5, 0.9, 1.0}) {
    const Matrix7d P_a = draws.covariance(), P_b = draws.covariance();
    const Matrix7d L_a = P_a.llt().matrixL(), L_b = P_b.llt().matrixL();
    const double w = intersectionWeight(P_a, P_b);
    const Matrix7d naive = (P_a.inverse() + P_b.inverse()).inverse();
    Matrix7d errors = Matrix7d::Zero(), naive_errors = Matrix7d::Zero(), claimed;
    constexpr int kDraws = 8000;
    for (int i = 0; i < kDraws; ++i) {
      const Vector7d common = draws.vector();
      const Vector7d own = std::sqrt(1.0 - correlation * correlation) * draws.vector();
      const Vector7d e_a = L_a * common, e_b = L_b * (correlation * common + own);
      // Small enough that no draw contradicts and yaw does not wrap.
      constexpr double kSmall = 1e-3;
      const CuboidGaussian fused = intersect({kSmall * e_a, P_a}, {kSmall * e_b, P_b}, w);
      const Vector7d e = fused.mean / kSmall;
      const Vector7d e_naive = naive * (P_a.inverse() * e_a + P_b.inverse() * e_b);
      errors += e * e.transpose() / kDraws;
      naive_errors += e_naive * e_naive.transpose() / kDraws;
      claimed = fused.covariance;
    }
    EXPECT_LT(boast(errors, claimed), 1.1) << "correlation " << correlation;
    naive_boast = std::max(naive_boast, boast(naive_errors, naive));
  }
  EXPECT_GT(naive_boast, 1.5) << "a claim that this test refuses";
}

TEST(CovarianceIntersection, TakesYawModuloAHalfTurn) {
  Draws draws(5);
  CuboidGaussian a = draws.gaussian();
  a.mean[3] = 0.1;
  CuboidGaussian b = a;
  b.mean[3] = 0.1 + std::numbers::pi;
  const CuboidGaussian fused = intersect(a, b, 0.5);
  EXPECT_NEAR(fused.mean[3], 0.1, 1e-9);
  EXPECT_TRUE(fused.covariance.isApprox(a.covariance, 1e-6));
}

TEST(CovarianceIntersection, CoversBothWhereTheyContradictEachOther) {
  CuboidGaussian a, b;
  a.covariance = b.covariance = 0.01 * Matrix7d::Identity();
  b.mean[0] = 3.0;
  const CuboidGaussian fused = intersect(a, b, 0.5);
  EXPECT_NEAR(fused.mean[0], 1.5, 1e-12);
  EXPECT_GT(std::sqrt(fused.covariance(0, 0)), 1.5);
  EXPECT_NEAR(fused.covariance(1, 1), 0.01, 1e-12) << "they agree on that";
}

TEST(Pooling, IsTheWeightedMeanOfTheLogOdds) {
  EXPECT_NEAR(pooled(0.7, 0.7, 0.3), 0.7, 1e-12);
  EXPECT_NEAR(logOdds(pooled(0.9, 0.2, 0.25)), 0.25 * logOdds(0.9) + 0.75 * logOdds(0.2), 1e-9);
  EXPECT_NEAR(pooled(0.9, 0.1, 0.5), 0.5, 1e-12);
  EXPECT_GE(pooled(0.0, 1.0, 0.5), 0.0);
  EXPECT_LE(pooled(1.0, 1.0, 0.5), 1.0);
}

}  // namespace
}  // namespace perdure::mapping
