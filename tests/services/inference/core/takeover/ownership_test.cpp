#include "services/inference/core/takeover/ownership.h"

#include <gtest/gtest.h>

namespace perdure::inference {
namespace {

using std::chrono::milliseconds;
constexpr Duration kLease = milliseconds(300);
constexpr Duration kFresh = milliseconds(60);
constexpr bool kAlone = true, kOthers = false;
constexpr std::int64_t kLow = Ownership::kOutOfForm;

Ownership::Time at(int ms) { return Ownership::Time(milliseconds(ms)); }

TEST(Ownership, StandbyIsOneLower) {
  EXPECT_EQ(Ownership(10, false, kLease).strengthFor(at(0), kFresh, 0, kOthers), 10);
  EXPECT_EQ(Ownership(10, true, kLease).strengthFor(at(0), kFresh, 0, kOthers), 9);
}

TEST(Ownership, AResultOlderThanTheLeaseIsWrittenBelowAHealthyStandby) {
  Ownership owner(10, false, kLease);
  EXPECT_EQ(owner.strengthFor(at(0), kLease, 0, kOthers), 10);
  EXPECT_EQ(owner.strengthFor(at(100), kLease + milliseconds(1), 0, kOthers), kLow);
}

TEST(Ownership, AProcessThatWasTakenForDeadDropsBeforeItsNextWrite) {
  Ownership owner(10, false, kLease);
  EXPECT_EQ(owner.strengthFor(at(0), kFresh, 0, kAlone), 10);
  EXPECT_EQ(owner.strengthFor(at(100), kFresh, 1, kAlone), kLow);
}

TEST(Ownership, FormComesBackAfterTenGoodResultsInARow) {
  Ownership owner(10, false, kLease);
  owner.strengthFor(at(0), kFresh, 1, kAlone);
  for (int i = 1; i < 6; ++i) {
    EXPECT_EQ(owner.strengthFor(at(i * 1000), kFresh, 1, kAlone), kLow);
  }
  EXPECT_EQ(owner.strengthFor(at(6000), milliseconds(400), 1, kAlone), kLow);
  for (int i = 1; i < 10; ++i) {
    EXPECT_EQ(owner.strengthFor(at(6000 + i * 1000), kFresh, 1, kAlone), kLow) << i;
  }
  EXPECT_FALSE(owner.inForm());
  EXPECT_EQ(owner.strengthFor(at(16000), kFresh, 1, kAlone), 10);
  EXPECT_TRUE(owner.inForm());
}

TEST(Ownership, AHeapOfOldFramesWorkedOffAtOnceDoesNotBringFormBack) {
  Ownership owner(10, false, kLease);
  owner.strengthFor(at(0), kFresh, 1, kAlone);
  for (int i = 0; i < 100; ++i) {
    EXPECT_EQ(owner.strengthFor(at(1 + i), kFresh, 1, kAlone), kLow);
  }
  EXPECT_EQ(owner.strengthFor(at(899), kFresh, 1, kAlone), kLow);
  EXPECT_EQ(owner.strengthFor(at(900), kFresh, 1, kAlone), 10);
}

TEST(Ownership, OneThatIsInFormAgainTakesNothingFromAnotherThatIsHeard) {
  Ownership owner(10, false, kLease);
  // the owner has resumed and has not received other messages yet
  owner.strengthFor(at(0), kFresh, 1, kAlone);
  for (int i = 1; i < 100; ++i) {
    EXPECT_EQ(owner.strengthFor(at(i * 100), kFresh, 1, kOthers), kLow) << i;
  }
  EXPECT_TRUE(owner.inForm());
  EXPECT_TRUE(owner.spare());
  EXPECT_EQ(owner.strengthFor(at(10000), kFresh, 1, kAlone), 10) << "the other one is gone";
  EXPECT_EQ(owner.strengthFor(at(10100), kFresh, 1, kOthers), 10);
}

TEST(Ownership, ThreeFailuresOfTheNetworkInARowLoseForm) {
  Ownership owner(10, false, kLease);
  EXPECT_FALSE(owner.noteFailure(at(0)));
  EXPECT_FALSE(owner.noteFailure(at(100)));
  EXPECT_EQ(owner.strengthFor(at(200), kFresh, 0, kOthers), 10);
  EXPECT_FALSE(owner.noteFailure(at(300)));
  EXPECT_FALSE(owner.noteFailure(at(400)));
  EXPECT_TRUE(owner.noteFailure(at(500)));
  EXPECT_FALSE(owner.noteFailure(at(600))) << "it is told once";
  EXPECT_EQ(owner.strength(), kLow);
}

TEST(Ownership, OneThatRehearsesIsBelowAllOthersUntilItLeads) {
  Ownership newcomer = Ownership::unheard(kLease);
  EXPECT_LT(newcomer.strengthFor(at(0), kFresh, 0, kOthers), kLow);
  EXPECT_LT(newcomer.strengthFor(at(100), 2 * kLease, 0, kOthers), kLow);
  newcomer.lead(20);
  for (int i = 0; i < 20; ++i) newcomer.strengthFor(at(200 + 100 * i), kFresh, 0, kAlone);
  EXPECT_EQ(newcomer.strength(), 20);
}

}  // namespace
}  // namespace perdure::inference
