// Single entries of the ledger: the cause that each change is attributed to.

#include "services/semantic_filter/core/belief/ledger.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace perdure::semantic_filter {
namespace {

Ledger published(const ClassAccount& account) {
  Ledger ledger;
  account.publish(ledger);
  return ledger;
}

double sumOf(const std::vector<double>& nats) {
  double sum = 0.0;
  for (const double each : nats) sum += each;
  return sum;
}

TEST(Existence, SumsToTheLogOddsOverAMillionChanges) {
  Existence r(0.2, ExistenceEvidence::kPrior, {});
  std::mt19937 random(3);
  std::uniform_real_distribution<double> any(0.001, 0.999);
  for (int i = 0; i < 1'000'000; ++i) {
    const double next = any(random);
    r.become(next, next > r ? ExistenceEvidence::kHit : ExistenceEvidence::kMiss, {});
    r.shift(ExistenceEvidence::kMiss, ExistenceEvidence::kUnmappedOccluder, 0.1 * next, {});
  }
  double sum = 0.0;
  for (const auto& entry : r.entries()) sum += entry.log_odds;
  EXPECT_NEAR(sum, std::log(r / (1.0 - r)), 1e-6);
  EXPECT_EQ(r.of(ExistenceEvidence::kHit).count + r.of(ExistenceEvidence::kMiss).count, 1'000'000U);
  EXPECT_GT(r.of(ExistenceEvidence::kHit).log_odds, 1e5);
}

TEST(Existence, KeepsTheFirstAndTheLastTimeOfEachCause) {
  Existence r(0.2, ExistenceEvidence::kPrior, fromNanoseconds(5));
  for (const int t : {10, 20, 30}) r.become(0.5, ExistenceEvidence::kHit, fromNanoseconds(t));
  r.note(ExistenceEvidence::kHidden, {0.0, 3, fromNanoseconds(31), fromNanoseconds(33)});
  r.note(ExistenceEvidence::kHidden, {0.0, 2, fromNanoseconds(40), fromNanoseconds(41)});
  r.note(ExistenceEvidence::kHidden, {});
  const LedgerEntry hit = r.of(ExistenceEvidence::kHit), hidden = r.of(ExistenceEvidence::kHidden);
  EXPECT_EQ(hit.count, 3U);
  EXPECT_EQ(hit.first, fromNanoseconds(10));
  EXPECT_EQ(hit.last, fromNanoseconds(30));
  EXPECT_EQ(hidden, (LedgerEntry{0.0, 5, fromNanoseconds(31), fromNanoseconds(41)}));
}

TEST(Existence, StaysFiniteWhereExistenceIsZeroOrOne) {
  Existence r(0.5, ExistenceEvidence::kPrior, {});
  r.become(0.0, ExistenceEvidence::kLost, {});
  EXPECT_LT(r.of(ExistenceEvidence::kLost).log_odds, -30.0);
  r.become(1.0, ExistenceEvidence::kHit, {});
  for (const auto& entry : r.entries()) EXPECT_TRUE(std::isfinite(entry.log_odds));
}

TEST(ClassAccount, KeepsTheOustedClassThatCameClosest) {
  ClassAccount account;
  account.book({{"car", 0.5}, {"van", 0.3}, {"bus", 0.2}}, ClassEvidence::kPrior, {});
  account.book({{"car", 0.8}, {"van", 0.15}, {"bus", 0.05}}, ClassEvidence::kActivation, {});
  account.book({{"car", 0.84}, {"van", 0.16}}, ClassEvidence::kPruning, fromNanoseconds(1));
  EXPECT_EQ(published(account).ousted.at(0).name, "bus");
  account.book({{"car", 0.6}, {"van", 0.4}}, ClassEvidence::kGeometry, {});
  account.book({{"car", 1.0}}, ClassEvidence::kPruning, fromNanoseconds(7));
  const auto ousted = published(account).ousted;
  ASSERT_EQ(ousted.size(), 1U);
  EXPECT_EQ(ousted[0].name, "van");
  EXPECT_EQ(ousted[0].by, "car");
  EXPECT_EQ(ousted[0].at, fromNanoseconds(7));
  EXPECT_NEAR(sumOf(ousted[0].log_odds), std::log(0.6 / 0.4), 1e-12);
  EXPECT_NEAR(ousted[0].log_odds[0], std::log(0.5 / 0.3), 1e-12);
  ASSERT_EQ(published(account).classes.size(), 1U);
  EXPECT_NEAR(sumOf(published(account).classes[0].log_odds), 0.0, 1e-12);
}

TEST(ClassAccount, RestoresWhatItPublished) {
  ClassAccount account;
  account.book({{"car", 0.9}, {"van", 0.1}}, ClassEvidence::kPrior, {});
  account.book({{"car", 1.0}}, ClassEvidence::kPruning, {});
  const ClassAccount again(published(account).classes, published(account).ousted);
  EXPECT_EQ(published(again).classes, published(account).classes);
  EXPECT_EQ(published(again).ousted, published(account).ousted);
}

}  // namespace
}  // namespace perdure::semantic_filter
