#include "services/inference/core/suppress.h"

#include <gtest/gtest.h>

#include <cmath>

namespace perdure::inference {
namespace {

Candidate candidate(Box box, std::vector<float> activations) {
  return {box, 0.5, std::move(activations)};
}

TEST(Suppress, KeepsTheBoxOfMostTotalEvidenceAndTheEvidenceOfBoth) {
  const auto kept = suppress(
      {candidate({0, 0, 10, 10}, {0, 1.0F, 2.0F}), candidate({0, 0, 10, 9}, {0, 3.0F, -4.0F})}, 0.6,
      100);
  ASSERT_EQ(kept.size(), 1u);
  EXPECT_EQ(kept[0].box.y2, 9);
  EXPECT_EQ(kept[0].activations, (std::vector<float>{0, 3.0F, 2.0F}));
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
