#include <gtest/gtest.h>

#include <cmath>

#include "services/semantic_filter/core/belief/learned.h"

namespace perdure::semantic_filter {
namespace {

constexpr std::uint64_t kNetwork = 17, kOther = 18;
constexpr double kAssumed = 200.0;

TEST(NoiseScales, AreAsAssumedUntilTheFirstResiduals) {
  NoiseScales scales(4000.0);
  EXPECT_EQ(scales.ratio(kNetwork, kAssumed), 1.0);
  scales.learn(kOther, {4.0, 1000.0});
  EXPECT_EQ(scales.ratio(kNetwork, kAssumed), 1.0);
  EXPECT_EQ(scales.ratio(kOther, 0.0), 1.0);  // learning is off
}

TEST(NoiseScales, TheAssumptionWeighsAsManySides) {
  NoiseScales scales(4000.0);
  scales.learn(kNetwork, {0.2, kAssumed});
  EXPECT_NEAR(scales.ratio(kNetwork, kAssumed), 0.6, 1e-12);
  for (int i = 0; i < 100; ++i) scales.learn(kNetwork, {0.2, 30.0});
  EXPECT_NEAR(scales.ratio(kNetwork, kAssumed), 0.25, 0.01);
}

TEST(NoiseScales, FollowANetworkThatGetsWorse) {
  NoiseScales scales(4000.0);
  for (int i = 0; i < 2000; ++i) scales.learn(kNetwork, {0.2, 50.0});
  for (int i = 0; i < 400; ++i) scales.learn(kNetwork, {2.0, 50.0});
  EXPECT_GT(scales.ratio(kNetwork, kAssumed), 1.7);
}

TEST(NoiseScales, StayWithinTheirLimits) {
  NoiseScales scales(4000.0);
  for (int i = 0; i < 1000; ++i) scales.learn(kNetwork, {0.0, 50.0});
  EXPECT_GE(scales.ratio(kNetwork, kAssumed), 0.04);
  for (int i = 0; i < 1000; ++i) scales.learn(kOther, {1e6, 50.0});
  EXPECT_LE(scales.ratio(kOther, kAssumed), 9.0);
  const double before = scales.ratio(kOther, kAssumed);
  scales.learn(kOther, {std::nan(""), 50.0});
  scales.learn(kOther, {1.0, 0.0});
  EXPECT_EQ(scales.ratio(kOther, kAssumed), before);
}

}  // namespace
}  // namespace perdure::semantic_filter
