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

/// Evidence of the residuals of a fit if the true scales are `truth`: `noise` and `lasting` sides,
/// of which a part tells about both.
SideEvidence evidenceOf(const SideVariances& learned, const SideScales& truth, double noise,
                        double lasting) {
  const SideScales now = learned.scales(kNetwork);
  const double both = 0.3 * lasting;
  SideEvidence evidence;
  evidence.information << noise, both, both, lasting;
  const Eigen::Vector2d excess(truth.noise / now.noise - 1.0, truth.lasting / now.lasting - 1.0);
  evidence.gradient = evidence.information * excess;
  return evidence;
}

TEST(SideVariances, AreAsAssumedUntilTheFirstEvidence) {
  SideVariances variances;
  EXPECT_EQ(variances.scales(kNetwork).noise, 1.0);
  EXPECT_EQ(variances.scales(kNetwork).lasting, 1.0);
  variances.learn(kOther, evidenceOf(variances, {4.0, 4.0}, 1000.0, 100.0), kAssumed);
  variances.learn(kNetwork, evidenceOf(variances, {4.0, 4.0}, 1000.0, 100.0), 0.0);  // off
  variances.learn(kNetwork, {}, kAssumed);
  EXPECT_EQ(variances.scales(kNetwork).noise, 1.0);
  EXPECT_EQ(variances.scales(kNetwork).lasting, 1.0);
  EXPECT_GT(variances.scales(kOther).noise, 1.5);
}

TEST(SideVariances, FindBothScales) {
  SideVariances variances;
  for (int i = 0; i < 200; ++i)
    variances.learn(kNetwork, evidenceOf(variances, {0.3, 4.0}, 40.0, 8.0), kAssumed);
  EXPECT_NEAR(variances.scales(kNetwork).noise, 0.3, 0.03);
  EXPECT_NEAR(variances.scales(kNetwork).lasting, 4.0, 0.4);
}

TEST(SideVariances, TheAssumptionWeighsAsManySides) {
  SideVariances variances;
  SideEvidence evidence;
  evidence.information(0, 0) = kAssumed;
  evidence.gradient[0] = -0.8 * kAssumed;
  variances.learn(kNetwork, evidence, kAssumed);
  EXPECT_NEAR(variances.scales(kNetwork).noise, std::exp(-0.4), 1e-12);
  EXPECT_EQ(variances.scales(kNetwork).lasting, 1.0);
}

TEST(SideVariances, FollowANetworkThatGetsWorse) {
  SideVariances variances;
  for (int i = 0; i < 2000; ++i)
    variances.learn(kNetwork, evidenceOf(variances, {0.2, 0.5}, 50.0, 8.0), kAssumed);
  for (int i = 0; i < 400; ++i)
    variances.learn(kNetwork, evidenceOf(variances, {2.0, 3.0}, 50.0, 8.0), kAssumed);
  EXPECT_GT(variances.scales(kNetwork).noise, 1.7);
  EXPECT_GT(variances.scales(kNetwork).lasting, 2.0);
}

TEST(SideVariances, StayWithinTheirLimits) {
  SideVariances variances;
  for (int i = 0; i < 1000; ++i)
    variances.learn(kNetwork, evidenceOf(variances, {1e-6, 1e6}, 50.0, 8.0), kAssumed);
  EXPECT_GE(variances.scales(kNetwork).noise, 0.04 - 1e-9);
  EXPECT_LE(variances.scales(kNetwork).lasting, 9.0 + 1e-9);
  const SideScales before = variances.scales(kNetwork);
  SideEvidence broken = evidenceOf(variances, {1.0, 1.0}, 50.0, 8.0);
  broken.gradient[1] = std::nan("");
  variances.learn(kNetwork, broken, kAssumed);
  EXPECT_EQ(variances.scales(kNetwork).noise, before.noise);
  EXPECT_EQ(variances.scales(kNetwork).lasting, before.lasting);
}

}  // namespace
}  // namespace perdure::semantic_filter
