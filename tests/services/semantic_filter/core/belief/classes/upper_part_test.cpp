#include "services/semantic_filter/core/belief/classes/upper_part.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "common/math/gaussian.h"
#include "tests/services/semantic_filter/scene.h"

namespace perdure::semantic_filter {
namespace {

using testing::makePrior;
using testing::makeState;

/// A class whose width is strongly correlated with its length and height.
ClassPrior correlated() {
  ClassPrior prior = makePrior("car", 4.2, 1.75, 1.5, 0.1);
  prior.log_size_covariance.array() += 0.02;
  return prior;
}

Hypothesis partSeen(double length, double height) {
  Hypothesis h;
  h.class_name = "car";
  h.upper_part = true;
  h.x = makeState(10.0, 3.0, 2.0, 0.4, length, 1.9, height);
  h.P.setZero();
  h.P.diagonal().head<kBias>() << 0.04, 0.05, 0.01, 0.02, 0.002, 0.003, 0.004;
  h.P(2, kSize + 2) = h.P(kSize + 2, 2) = 0.003;
  h.C.setConstant(0.01);
  return h;
}

TEST(UpperPart, TheWholeObjectHasTheMomentsOfWhatTheClassAllows) {
  const ClassPrior prior = correlated();
  const Hypothesis part = partSeen(2.0, 1.3), whole = wholeOf(part, prior);
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  const Eigen::Matrix3d L = prior.log_size_covariance.llt().matrixL();
  const Eigen::Matrix<double, 7, 7> of_part =
      Eigen::Matrix<double, 7, 7>(part.P.topLeftCorner<7, 7>()).llt().matrixL();
  double n = 0.0, sum = 0.0, squares = 0.0, height = 0.0, height_squares = 0.0;
  for (int i = 0; i < 2'000'000; ++i) {
    const Eigen::Vector3d size =
        prior.log_size + L * Eigen::Vector3d(normal(random), normal(random), normal(random));
    // Has this width, and at least the visible height.
    if (std::abs(size[1] - part.x[kSize + 1]) > 0.02 || size[2] < part.x[kSize + 2]) continue;
    Eigen::Matrix<double, 7, 1> e;
    for (int k = 0; k < 7; ++k) e[k] = normal(random);
    const Eigen::Matrix<double, 7, 1> x = part.x.head<7>() + of_part * e;
    const double z = x[2] + 0.5 * (std::exp(x[6]) - std::exp(size[2]));
    ++n, sum += z, squares += z * z, height += size[2], height_squares += size[2] * size[2];
  }
  ASSERT_GT(n, 1e4);
  const double z = sum / n, log_height = height / n;
  EXPECT_NEAR(whole.x[2], z, 0.01);
  EXPECT_NEAR(whole.x[kSize + 2], log_height, 0.005);
  EXPECT_NEAR(std::sqrt(whole.P(2, 2)), std::sqrt(squares / n - z * z), 0.005);
  EXPECT_NEAR(std::sqrt(whole.P(kSize + 2, kSize + 2)),
              std::sqrt(height_squares / n - log_height * log_height), 0.005);
}

TEST(UpperPart, TheTopStaysAndTheBeliefIsACovariance) {
  for (const double height : {0.1, 0.8, 1.5, 2.2, 9.0}) {
    const Hypothesis part = partSeen(2.0, height), whole = wholeOf(part, correlated());
    EXPECT_FALSE(whole.upper_part);
    EXPECT_GE(whole.x[kSize + 2], part.x[kSize + 2]);
    EXPECT_NEAR(whole.x[2] + 0.5 * std::exp(whole.x[kSize + 2]),
                part.x[2] + 0.5 * std::exp(part.x[kSize + 2]), 1e-9);
    EXPECT_EQ(whole.x.head<2>(), part.x.head<2>());
    EXPECT_TRUE(isCovariance(Eigen::Matrix<double, 7, 7>(whole.P.topLeftCorner<7, 7>()))) << height;
  }
}

TEST(UpperPart, APartMayLieAnywhereAlongTheObject) {
  const Hypothesis shorter = wholeOf(partSeen(1.0, 0.5), correlated());
  const Hypothesis longer = wholeOf(partSeen(3.9, 0.5), correlated());
  const Eigen::Vector2d along(std::cos(0.4), std::sin(0.4)), across(-along.y(), along.x());
  const auto spread = [](const Hypothesis& h, const Eigen::Vector2d& axis) {
    return std::sqrt(axis.dot(h.P.topLeftCorner<2, 2>() * axis));
  };
  EXPECT_GT(spread(shorter, along), 1.5);
  EXPECT_LT(spread(longer, along), 0.5);
  EXPECT_LT(spread(shorter, across), 0.25);
}

TEST(UpperPart, AWholeObjectStaysAsItIs) {
  Hypothesis h = partSeen(2.0, 0.5);
  h.upper_part = false;
  EXPECT_EQ(wholeOf(h, correlated()).x, h.x);
  EXPECT_EQ(wholeOf(h, correlated()).P, h.P);
}

}  // namespace
}  // namespace perdure::semantic_filter
