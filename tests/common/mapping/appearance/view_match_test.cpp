// Matches of views: their accuracy, their confidence, and views that must not match.
#include "common/mapping/appearance/view_match.h"

#include <gtest/gtest.h>

#include <numbers>
#include <random>

#include "common/math/gaussian.h"
#include "common/math/hamming_distance.h"

namespace perdure::mapping {
namespace {

constexpr float kSigma = 0.2F;

class Street {
 public:
  explicit Street(std::uint32_t seed) : random_(seed) {}

  Descriptor descriptor() {
    Descriptor d;
    for (auto& byte : d) byte = static_cast<std::uint8_t>(random_());
    return d;
  }
  Eigen::Vector3d place() { return {uniform(2, 40), uniform(-12, 12), uniform(0, 6)}; }
  double uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  Eigen::Vector3d noise() {
    std::normal_distribution<double> normal(0.0, kSigma);
    return {normal(random_), normal(random_), normal(random_)};
  }
  Descriptor otherwise(Descriptor d, int bits) {
    for (int i = 0; i < bits; ++i) {
      const auto bit = random_() % 256;
      d[bit / 8] = static_cast<std::uint8_t>(d[bit / 8] ^ (1U << (bit % 8)));
    }
    return d;
  }

 private:
  std::mt19937 random_;
};

SeenPoint point(const Eigen::Vector3d& p, const Descriptor& d) {
  return {p.cast<float>(), kSigma, d};
}

struct Two {
  View stored, seen;
  LevelPose T_AB;
};

/// Two views with `common` points that are the same, and others that are not.
Two twoViews(std::uint32_t seed, std::size_t common, std::size_t others) {
  Street street(seed);
  Two two;
  two.T_AB = {{street.uniform(-8, 8), street.uniform(-4, 4), street.uniform(-0.5, 0.5)},
              street.uniform(-0.6, 0.6)};
  for (std::size_t i = 0; i < common; ++i) {
    const Eigen::Vector3d p_A = street.place();
    const Descriptor d = street.descriptor();
    two.stored.push_back(point(p_A + street.noise(), d));
    two.seen.push_back(point(two.T_AB.inverse() * p_A + street.noise(), street.otherwise(d, 30)));
  }
  for (std::size_t i = 0; i < others; ++i) {
    two.stored.push_back(point(street.place(), street.descriptor()));
    two.seen.push_back(point(street.place(), street.descriptor()));
  }
  return two;
}

TEST(ViewMatch, LaysAViewWhereItLiesAndSaysHowWell) {
  constexpr int kRuns = 100;
  double nees = 0.0;
  for (std::uint32_t seed = 0; seed < kRuns; ++seed) {
    const Two two = twoViews(seed, 16, 20);
    const auto match = matchViews(two.stored, two.seen);
    ASSERT_TRUE(match) << seed;
    EXPECT_GE(match->points, 12u) << seed;
    EXPECT_GT(match->nats, 30.0) << seed;
    const LevelError error = difference(match->T_AB.mean, two.T_AB);
    EXPECT_LT(error.head<3>().norm(), 1.0) << seed;
    nees += squaredMahalanobis(error, match->T_AB.covariance) / kRuns;
  }
  // Four degrees of freedom. The value is below 4, because kPointError_m is added to the declared
  // errors of the points.
  EXPECT_GT(nees, 1.5);
  EXPECT_LT(nees, 4.6);
}

TEST(ViewMatch, FewPointsThatAgreeAreTakenForChance) {
  std::size_t sure = 0;
  for (std::uint32_t seed = 0; seed < 50; ++seed) {
    const Two two = twoViews(seed, 3, 36);
    const auto match = matchViews(two.stored, two.seen);
    sure += match && match->nats > 8.0 ? 1 : 0;
  }
  EXPECT_EQ(sure, 0u);
}

TEST(ViewMatch, PointsThatLookAlikeButLieOtherwiseAreAnotherPlace) {
  std::size_t sure = 0;
  for (std::uint32_t seed = 0; seed < 50; ++seed) {
    Two two = twoViews(seed, 30, 5);
    Street elsewhere(seed + 1000);
    for (SeenPoint& p : two.seen) p.p = elsewhere.place().cast<float>();
    const auto match = matchViews(two.stored, two.seen);
    sure += match && match->nats > 8.0 ? 1 : 0;
  }
  EXPECT_EQ(sure, 0u);
}

TEST(ViewMatch, APatternThatRepeatsProposesNothing) {
  Two two = twoViews(1, 20, 0);
  const Descriptor same = two.stored.front().descriptor;
  for (SeenPoint& p : two.stored) p.descriptor = same;
  for (SeenPoint& p : two.seen) p.descriptor = same;
  EXPECT_FALSE(matchViews(two.stored, two.seen));
}

TEST(ViewMatch, EmptyViewsMatchNothing) {
  const Two two = twoViews(1, 20, 0);
  EXPECT_FALSE(matchViews({}, two.seen));
  EXPECT_FALSE(matchViews(two.stored, {}));
  EXPECT_FALSE(matchViews({}, {}));
}

TEST(ViewMatch, DistanceOfDescriptorsIsTheNumberOfBits) {
  Descriptor a{}, b{};
  EXPECT_EQ(hammingDistance(a, b), 0);
  b[3] = 0x81;
  b[31] = 0xff;
  EXPECT_EQ(hammingDistance(a, b), 10);
}

}  // namespace
}  // namespace perdure::mapping
