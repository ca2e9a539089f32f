#include "tools/evaluate/reliability.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/sim/dice.h"

namespace perdure::tools {
namespace {

/// Claims with stated probability p and true probability p', where the odds of p' are those of p to
/// the power `temper`.
Reliability believer(double temper, std::size_t count) {
  sim::Dice dice(3);
  Reliability result{"existence", {}};
  for (std::size_t i = 0; i < count; ++i) {
    const double log_odds = 3.0 * dice.normal();
    const double believed = 1.0 / (1.0 + std::exp(-log_odds));
    const double is = 1.0 / (1.0 + std::exp(-temper * log_odds));
    result.claims.push_back({believed, dice.chance(is)});
  }
  return result;
}

TEST(Reliability, OneWhoBelievesWhatIsSoPassesAndAnOverConfidentOneDoesNot) {
  const Reliability honest = believer(1.0, 1500), rash = believer(0.3, 1500);
  EXPECT_LT(honest.calibrationError(), 0.04);
  EXPECT_GT(honest.skill(), 0.5);
  EXPECT_GT(rash.calibrationError(), 0.1);
  EXPECT_LT(rash.skill(), 0.5);
  EXPECT_GT(believer(3.0, 1500).calibrationError(), 0.05) << "a timid one";
}

TEST(Reliability, BinsHoldWhatFallsIntoThemOneIncluded) {
  const Reliability r{"", {{0.0, false}, {0.05, true}, {0.95, true}, {1.0, true}}};
  const auto bins = r.bins();
  ASSERT_EQ(bins.size(), 10U);
  EXPECT_EQ(bins[0].count, 2U);
  EXPECT_DOUBLE_EQ(bins[0].believed, 0.025);
  EXPECT_DOUBLE_EQ(bins[0].observed, 0.5);
  EXPECT_EQ(bins[9].count, 2U);
  EXPECT_DOUBLE_EQ(r.calibrationError(), 0.5 * 0.475 + 0.5 * 0.025);
  EXPECT_NEAR(r.brier(), (0.95 * 0.95 + 0.05 * 0.05) / 4.0, 1e-12);
  EXPECT_NEAR(r.skill(), 1.0 - r.brier() / (0.75 * 0.25), 1e-12);
}

TEST(Reliability, NothingToSayIsNoSkill) {
  EXPECT_EQ(Reliability{}.calibrationError(), 0.0);
  EXPECT_EQ(Reliability{}.skill(), 0.0);
  EXPECT_EQ((Reliability{"", {{0.9, true}, {0.8, true}}}.skill()), 0.0) << "all is so";
  EXPECT_EQ(ClassReliability{}.skill(), 0.0);
}

TEST(Reliability, OfClassesTheBestIsAskedAndAllOfThemAreScored) {
  ClassReliability r;
  r.claims = {{{{"car", 0.9}, {"van", 0.1}}, "car"}, {{{"car", 0.6}, {"van", 0.4}}, "van"}};
  const Reliability best = r.best();
  ASSERT_EQ(best.claims.size(), 2U);
  EXPECT_DOUBLE_EQ(best.claims[0].believed, 0.9);
  EXPECT_TRUE(best.claims[0].so);
  EXPECT_FALSE(best.claims[1].so);
  EXPECT_NEAR(r.brier(), 0.5 * (0.01 + 0.01 + 0.36 + 0.36), 1e-12);
  EXPECT_NEAR(r.skill(), 1.0 - r.brier() / 0.5, 1e-12);
  r.claims = {{{{"car", 1.0}}, "other"}};
  EXPECT_NEAR(r.brier(), 2.0, 1e-12) << "a class that was not thought of";
}

}  // namespace
}  // namespace perdure::tools
