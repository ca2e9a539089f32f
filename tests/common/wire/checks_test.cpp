#include "common/wire/checks.h"

#include <gtest/gtest.h>

#include <limits>

namespace perdure::wire {
namespace {

TEST(Checks, NumbersMustBeFiniteAndInside) {
  EXPECT_TRUE(inside(1.0, kProbability));
  EXPECT_FALSE(inside(1.0 + 1e-12, kProbability));
  EXPECT_FALSE(inside(std::numeric_limits<double>::quiet_NaN(), kProbability));
  EXPECT_FALSE(inside(std::numeric_limits<double>::infinity(), kCoordinate));
}

TEST(Checks, TextIsUtf8WithoutNul) {
  EXPECT_TRUE(isText(""));
  EXPECT_TRUE(isText("plain, grün, 車, 🚗"));
  EXPECT_FALSE(isText(std::string_view("a\0b", 3)));
  EXPECT_FALSE(isText("\xff"));
  EXPECT_FALSE(isText("\xc3"));              // truncated
  EXPECT_FALSE(isText("\xc0\xaf"));          // over-long encoding
  EXPECT_FALSE(isText("\xe0\x80\xaf"));      // over-long encoding
  EXPECT_FALSE(isText("\xed\xa0\x80"));      // a surrogate
  EXPECT_FALSE(isText("\xf4\x90\x80\x80"));  // a code point beyond U+10FFFF
}

TEST(Checks, DefinitenessDoesNotDependOnUnits) {
  Eigen::Matrix3d P = Eigen::Vector3d(1e-10, 1.0, 1e8).asDiagonal();
  EXPECT_TRUE(isDefinite(P));
  P(0, 1) = P(1, 0) = 0.9e-5;  // correlation .9
  EXPECT_TRUE(isDefinite(P));
  P(0, 1) = P(1, 0) = 1.1e-5;  // correlation 1.1
  EXPECT_FALSE(isDefinite(P));
  EXPECT_FALSE(isSemiDefinite(P));
}

TEST(Checks, ASemiDefiniteMatrixMayHaveDirectionsWithoutVariance) {
  Eigen::Matrix3d P = Eigen::Matrix3d::Zero();
  EXPECT_TRUE(isSemiDefinite(P));
  EXPECT_FALSE(isDefinite(P));
  P(0, 0) = 4.0;
  EXPECT_TRUE(isSemiDefinite(P));
  P(1, 2) = P(2, 1) = 1.0;  // a covariance without variance
  EXPECT_FALSE(isSemiDefinite(P));
  EXPECT_TRUE(isSemiDefinite(Eigen::Matrix3d::Ones()));
  EXPECT_FALSE(isSemiDefinite(-Eigen::Matrix3d::Identity()));
}

TEST(Checks, AsymmetricAndNotFiniteMatricesAreRefused) {
  Eigen::Matrix3d P = Eigen::Matrix3d::Identity();
  P(0, 1) = 0.1;
  EXPECT_FALSE(isDefinite(P));
  P(0, 1) = P(1, 0) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(isDefinite(P));
  EXPECT_FALSE(isSemiDefinite(P));
}

}  // namespace
}  // namespace perdure::wire
