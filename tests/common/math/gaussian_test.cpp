// Tests the decompositions against their definitions, for fixed and dynamic sizes.
#include "common/math/gaussian.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <limits>
#include <random>

#include "common/math/small_products.h"

namespace perdure {
namespace {

Eigen::MatrixXd random(int rows, int columns, unsigned seed) {
  std::mt19937 engine(seed);
  std::normal_distribution<double> normal;
  return Eigen::MatrixXd::NullaryExpr(rows, columns, [&] { return normal(engine); });
}

Eigen::MatrixXd covariance(int n, unsigned seed) {
  const Eigen::MatrixXd A = random(n, n + 2, seed);
  return A * A.transpose();
}

TEST(Gaussian, SolvesAndInvertsSymmetricMatrices) {
  const Eigen::Matrix<double, 7, 7> S = covariance(7, 1);
  const Eigen::MatrixXd B = random(7, 3, 2);
  EXPECT_LT((S * solveSymmetric(S, B) - B).norm(), 1e-9);
  EXPECT_LT((S * inverseSymmetric(S) - Eigen::MatrixXd::Identity(7, 7)).norm(), 1e-9);
  EXPECT_NEAR(squaredMahalanobis(B.col(0), S), B.col(0).dot(S.inverse() * B.col(0)), 1e-9);
}

TEST(Gaussian, RegressionLeavesNothingInCommon) {
  // With B = C S⁻¹, the residual x - B s has no covariance with s.
  const Eigen::MatrixXd S = covariance(6, 3), C = random(3, 6, 4);
  EXPECT_LT((C - regressOn(S, C) * S).norm(), 1e-9);
}

TEST(Gaussian, RegressionOnASingularMatrixIsZero) {
  Eigen::MatrixXd S = covariance(6, 3);
  S.row(2).setZero();
  S.col(2).setZero();
  EXPECT_TRUE(regressOn(S, random(3, 6, 4)).isZero(0.0));
}

TEST(Gaussian, CholeskyWhitensAndKnowsTheDeterminant) {
  const Eigen::Matrix4d S = covariance(4, 5);
  const Cholesky chol(S);
  ASSERT_TRUE(chol.positive());
  const Eigen::MatrixXd W = chol.whiten(Eigen::Matrix4d::Identity());
  EXPECT_LT((W.transpose() * W - S.inverse()).norm(), 1e-9);
  EXPECT_TRUE(W.isLowerTriangular(1e-15));
  EXPECT_LT((S * chol.solve(Eigen::Vector4d::Ones()) - Eigen::Vector4d::Ones()).norm(), 1e-10);
  EXPECT_NEAR(chol.logDeterminant(), std::log(S.determinant()), 1e-10);
}

TEST(Gaussian, CholeskyIsThatOfEigenWhateverTheSize) {
  for (int n = 1; n < 40; n += n < 18 ? 1 : 7) {
    const Eigen::MatrixXd S = covariance(n, 50 + n);
    const Cholesky chol(S);
    ASSERT_TRUE(chol.positive());
    Eigen::MatrixXd L = S;
    ASSERT_TRUE(choleskyInPlace(L));
    EXPECT_NEAR(chol.logDeterminant(), 2.0 * L.diagonal().array().log().sum(), 1e-9);
    for (const int columns : {1, 3, 4, 5, 8, 11}) {
      Eigen::MatrixXd B = random(n, columns, 90 + n);
      const Eigen::MatrixXd W = chol.whiten(B);
      whitenInPlace(L, B);
      EXPECT_LT((W - B).norm(), 1e-7 * (1.0 + B.norm())) << n << " x " << columns;
    }
  }
}

TEST(SmallProducts, AreThoseOfEigen) {
  const Eigen::Matrix<double, 14, 14> P = random(14, 14, 1);
  const Eigen::Matrix<double, 14, 6> C = random(14, 6, 2);
  const Eigen::Matrix<double, 4, 11> H = random(4, 11, 3);
  const Eigen::Matrix<double, 4, 6> G = random(4, 6, 4);
  const Eigen::Matrix<double, 7, 5> A = random(7, 5, 5);
  const Eigen::Matrix<double, 3, 5> B = random(3, 5, 6);
  const auto same = [](const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
    return (a - b).cwiseAbs().maxCoeff() < 1e-13;
  };
  EXPECT_TRUE(same(leftTimesTransposed(P, H), P.leftCols<11>() * H.transpose()));
  EXPECT_TRUE(same(timesTransposed(C, G), C * G.transpose()));
  EXPECT_TRUE(same(timesTransposed(A, B), A * B.transpose()));
  EXPECT_TRUE(same(timesTop<6>(H, C), H * C.topRows<11>()));
  EXPECT_TRUE(same(timesTop<11>(H, P), H * P.topLeftCorner<11, 11>()));
  const Eigen::MatrixXd whole = C * C.transpose();
  const Eigen::MatrixXd lower = lowerTimesTransposed(C);
  EXPECT_TRUE(same(lower.triangularView<Eigen::Lower>(), whole.triangularView<Eigen::Lower>()));
}

TEST(Gaussian, CholeskyRefusesAPivotWhereverItIs) {
  for (int at = 0; at < 19; ++at) {
    Eigen::MatrixXd S = covariance(19, 7);
    S(at, at) = -1.0;
    EXPECT_FALSE(Cholesky(S).positive()) << at;
  }
}

TEST(Gaussian, WhatIsNotPositiveIsNoCovariance) {
  Eigen::MatrixXd S = covariance(5, 6);
  EXPECT_TRUE(isCovariance(S));
  S(4, 4) = -1.0;
  EXPECT_FALSE(Cholesky(S).positive());
  EXPECT_FALSE(isCovariance(S));
  EXPECT_EQ(logGaussian(Eigen::VectorXd::Zero(5), S), -std::numeric_limits<double>::infinity());
  S(4, 4) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(isCovariance(S));
}

TEST(Gaussian, DensityIsThatOfIndependentNormals) {
  const Eigen::Vector2d r(0.5, -2.0);
  const Eigen::Matrix2d S = Eigen::Vector2d(4.0, 0.25).asDiagonal();
  const double expected = -0.5 * (0.25 / 4.0 + 4.0 / 0.25) - std::log(2.0 * M_PI * 2.0 * 0.5);
  EXPECT_NEAR(logGaussian(r, S), expected, 1e-12);
}

TEST(Gaussian, LeastEigenvalueIsRaisedAndTheRestKept) {
  const Eigen::MatrixXd S = Eigen::Vector3d(2.0, -1.0, 1e-9).asDiagonal();
  const Eigen::MatrixXd T = withLeastEigenvalue(S, 1e-3);
  EXPECT_LT((eigenvalues(T) - Eigen::Vector3d(1e-3, 1e-3, 2.0)).norm(), 1e-12);
  EXPECT_LT((T - Eigen::MatrixXd(Eigen::Vector3d(2.0, 1e-3, 1e-3).asDiagonal())).norm(), 1e-12);
}

using Matrix6d = Eigen::Matrix<double, 6, 6>;

TEST(Gaussian, CholeskyOfABoundedSizeSolvesAndWhitens) {
  using Bounded = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 9, 9>;
  for (int n = 1; n <= 9; ++n) {
    const Eigen::MatrixXd B = random(n, n, n);
    const Bounded S = B * B.transpose() + Eigen::MatrixXd::Identity(n, n);
    const Cholesky chol(S);
    ASSERT_TRUE(chol.positive());
    const Bounded inverse_S = chol.solve(Bounded::Identity(n, n));
    EXPECT_LT((S * inverse_S - Bounded::Identity(n, n)).norm(), 1e-9) << n;
    EXPECT_LT((chol.unwhiten(chol.whiten(S)) - Bounded::Identity(n, n)).norm(), 1e-9) << n;
  }
}

TEST(Gaussian, InverseOfASingularMatrixIsNotFinite) {
  const Eigen::MatrixXd A = random(6, 6, 7), singular = Eigen::Matrix2d::Zero();
  const Matrix6d six = A;
  EXPECT_LT((inverse(MatrixView(A)) * A - Matrix6d::Identity()).norm(), 1e-9);
  EXPECT_LT((inverse(six) * six - Matrix6d::Identity()).norm(), 1e-9);
  EXPECT_FALSE(inverse(MatrixView(singular)).allFinite());
  EXPECT_FALSE(inverse(Matrix6d(Matrix6d::Zero())).allFinite());
}

}  // namespace
}  // namespace perdure
