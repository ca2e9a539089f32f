#include "services/inference/core/budget.h"

#include <gtest/gtest.h>

#include <random>

namespace perdure::inference {
namespace {

const std::vector<double> kShares = {1.0, 0.72, 0.49, 0.25};

/// Simulates a network that takes `full_ms` at its own size, with noise; returns how often the size
/// changed.
int run(Budget& budget, double full_ms, int frames, std::mt19937& random) {
  std::normal_distribution<double> noise(1.0, 0.05);
  int changes = 0;
  for (int i = 0; i < frames; ++i) {
    changes += budget.took(full_ms * kShares[budget.size()] * noise(random));
  }
  return changes;
}

TEST(Budget, WithoutOneTheSizeIsTheNetworksOwn) {
  Budget budget(0.0, kShares);
  for (int i = 0; i < 100; ++i) EXPECT_FALSE(budget.took(1e6));
  EXPECT_EQ(budget.size(), 0U);
}

TEST(Budget, GoesStraightToTheSizeThatKeepsIt) {
  std::mt19937 random(1);
  Budget budget(20.0, kShares);
  EXPECT_EQ(run(budget, 40.0, 10, random), 1);
  EXPECT_EQ(budget.size(), 3U) << "40 ms x .49 is 19.6, too near to 20";
  budget = Budget(20.0, kShares);
  run(budget, 30.0, 10, random);
  EXPECT_EQ(budget.size(), 2U);
}

TEST(Budget, OneSlowFrameIsNoReason) {
  Budget budget(20.0, kShares);
  for (int i = 0; i < 50; ++i) budget.took(i % 5 == 0 ? 90.0 : 12.0);
  EXPECT_EQ(budget.size(), 0U);
}

TEST(Budget, GoesBackStepByStepWhenThereIsRoomAgain) {
  std::mt19937 random(2);
  Budget budget(20.0, kShares);
  run(budget, 60.0, 20, random);
  EXPECT_EQ(budget.size(), 3U);
  EXPECT_EQ(run(budget, 12.0, 10, random), 0) << "not before many frames left room";
  run(budget, 12.0, 200, random);
  EXPECT_EQ(budget.size(), 0U);
}

TEST(Budget, DoesNotSwingWhereASizeIsJustTooSlow) {
  std::mt19937 random(3);
  for (double full = 15.0; full < 60.0; full += 1.5) {
    Budget budget(20.0, kShares);
    run(budget, full, 100, random);
    EXPECT_LE(run(budget, full, 2000, random), 1) << full << " ms at full size";
  }
}

TEST(Budget, StaysAtTheSmallestWhereNothingKeepsIt) {
  std::mt19937 random(4);
  Budget budget(1.0, kShares);
  run(budget, 100.0, 500, random);
  EXPECT_EQ(budget.size(), 3U);
}

}  // namespace
}  // namespace perdure::inference
