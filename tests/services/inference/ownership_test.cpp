#include "services/inference/core/ownership.h"

#include <gtest/gtest.h>

namespace perdure::inference {
namespace {

using std::chrono::milliseconds;
constexpr Duration kLease = milliseconds(300);
constexpr Duration kFresh = milliseconds(60);

Ownership::Time at(int ms) { return Ownership::Time(milliseconds(ms)); }

TEST(Ownership, StandbyIsOneLower) {
  EXPECT_EQ(Ownership(10, false, kLease).strengthFor(at(0), kFresh, 0), 10);
  EXPECT_EQ(Ownership(10, true, kLease).strengthFor(at(0), kFresh, 0), 9);
}

TEST(Ownership, AResultOlderThanTheLeaseIsWrittenBelowAHealthyStandby) {
  Ownership owner(10, false, kLease);
  EXPECT_EQ(owner.strengthFor(at(0), kLease, 0), 10);
  EXPECT_EQ(owner.strengthFor(at(100), kLease + milliseconds(1), 0), 8);
}

TEST(Ownership, AProcessThatWasTakenForDeadDropsBeforeItsNextWrite) {
  Ownership owner(10, false, kLease);
  EXPECT_EQ(owner.strengthFor(at(0), kFresh, 0), 10);
  EXPECT_EQ(owner.strengthFor(at(100), kFresh, 1), 8);
}

TEST(Ownership, FormComesBackAfterTenGoodResultsInARow) {
  Ownership owner(10, false, kLease);
  owner.strengthFor(at(0), kFresh, 1);
  for (int i = 1; i < 6; ++i) EXPECT_EQ(owner.strengthFor(at(i * 1000), kFresh, 1), 8);
  EXPECT_EQ(owner.strengthFor(at(6000), milliseconds(400), 1), 8);
  for (int i = 1; i < 10; ++i) EXPECT_EQ(owner.strengthFor(at(6000 + i * 1000), kFresh, 1), 8) << i;
  EXPECT_FALSE(owner.inForm());
  EXPECT_EQ(owner.strengthFor(at(16000), kFresh, 1), 10);
  EXPECT_TRUE(owner.inForm());
}

TEST(Ownership, AHeapOfOldFramesWorkedOffAtOnceDoesNotBringFormBack) {
  Ownership owner(10, false, kLease);
  owner.strengthFor(at(0), kFresh, 1);
  for (int i = 0; i < 100; ++i) EXPECT_EQ(owner.strengthFor(at(1 + i), kFresh, 1), 8);
  EXPECT_EQ(owner.strengthFor(at(899), kFresh, 1), 8);
  EXPECT_EQ(owner.strengthFor(at(900), kFresh, 1), 10);
}

}  // namespace
}  // namespace perdure::inference
