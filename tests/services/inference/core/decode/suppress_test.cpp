#include "services/inference/core/decode/suppress.h"

#include <gtest/gtest.h>

#include <cmath>

namespace perdure::inference {
namespace {

Candidate candidate(Box box, std::vector<float> activations) {
  return {box, 0.5, std::move(activations)};
}

TEST(Suppress, KeepsTheEvidenceOfBoth) {
  const auto kept = suppress(
      {candidate({0, 0, 10, 10}, {0, 1.0F, 2.0F}), candidate({0, 0, 10, 9}, {0, 3.0F, -4.0F})}, 0.6,
      100);
  ASSERT_EQ(kept.size(), 1u);
  EXPECT_EQ(kept[0].activations, (std::vector<float>{0, 3.0F, 2.0F}));
}

TEST(Suppress, TheBoxIsTheMeanByScoreAndOverlapAndSoIsItsDeviation) {
  Candidate best = candidate({0, 0, 10, 10}, {0, 3.0F}),
            other = candidate({0, 0, 10, 9}, {0, 1.0F});
  best.side_sigma = {1, 1, 1, 1};
  other.side_sigma = {1, 1, 1, 3};
  const double w = std::exp(-0.1 * 0.1 / 0.025);  // IoU .9
  auto kept = suppress({other, best}, 0.6, 100);
  ASSERT_EQ(kept.size(), 1u);
  EXPECT_NEAR(kept[0].box.y2, (10 + 9 * w) / (1 + w), 1e-9);
  EXPECT_NEAR(kept[0].side_sigma[3], (1 + 3 * w) / (1 + w), 1e-9);
  other.score = 0.05;
  kept = suppress({other, best}, 0.6, 100);
  EXPECT_NEAR(kept[0].box.y2, (10 + 0.9 * w) / (1 + 0.1 * w), 1e-9);
}

TEST(Suppress, WhatLiesOverABetterBoxOfItsClassLosesEvidence) {
  const Box far{0, 0, 10, 10}, half{5, 0, 30, 20};
  const auto evidenceOf = [&](Box second, std::vector<float> first) {
    return suppress({candidate(far, std::move(first)), candidate(second, {0, 2.0F, -20.0F})}, 0.6,
                    100)[1]
        .activations[1];
  };
  EXPECT_NEAR(evidenceOf({20, 0, 30, 10}, {0, 6.0F, -20.0F}), 2.0, 1e-6) << "apart";
  EXPECT_NEAR(evidenceOf(half, {0, 6.0F, -20.0F}), 2.0 - kDoubleNats / 4, 1e-5) << "half of it";
  EXPECT_NEAR(evidenceOf({0, 0, 30, 30}, {0, 6.0F, -20.0F}), 2.0 - kDoubleNats, 1e-5) << "all";
  EXPECT_NEAR(evidenceOf({0, 0, 30, 30}, {0, -20.0F, 6.0F}), 2.0, 1e-5)
      << "a person before a car is no second car";
}

TEST(Suppress, LeavesNeighboursApart) {
  const auto kept = suppress(
      {candidate({0, 0, 10, 10}, {0, 1.0F}), candidate({3, 0, 13, 10}, {0, 2.0F})},  // IoU 7/13
      0.6, 100);
  EXPECT_EQ(kept.size(), 2u);
}

TEST(Suppress, ManySmallScoresWeighMoreThanOne) {
  EXPECT_NEAR(totalEvidence(candidate({}, {0, 0.0F, 0.0F})), std::log(2.0), 1e-12);
  EXPECT_NEAR(totalEvidence(candidate({}, {0, 700.0F, -700.0F})), 700.0, 1e-9);
}

TEST(Suppress, KeepsTheStrongestWhereThereAreTooManyAndTiesInOrder) {
  std::vector<Candidate> many;
  for (int i = 0; i < 5; ++i) {
    const double x = 100.0 * i;
    many.push_back(candidate({x, 0, x + 10, 10}, {0, i == 3 ? 2.0F : 1.0F}));
  }
  const auto kept = suppress(many, 0.6, 2);
  ASSERT_EQ(kept.size(), 2u);
  EXPECT_EQ(kept[0].box.x1, 300);
  EXPECT_EQ(kept[1].box.x1, 0);
}

TEST(Suppress, TakesNothing) { EXPECT_TRUE(suppress({}, 0.6, 10).empty()); }

}  // namespace
}  // namespace perdure::inference
