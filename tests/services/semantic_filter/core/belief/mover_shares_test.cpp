#include <gtest/gtest.h>

#include "services/semantic_filter/core/belief/learned.h"
#include "tests/services/semantic_filter/scene.h"

namespace perdure::semantic_filter {
namespace {

constexpr double kMinSpeed = 0.7;

ClassPrior carPrior(double moving) {
  ClassPrior prior;
  prior.name = "car";
  prior.moving = moving;
  return prior;
}

Track judged(double speed) {
  Track t = testing::makeObject(1, "car", testing::makeState(20, 0, 0.7, 0, 4, 1.8, 1.5), 0.04);
  t.life.once_confirmed = true;
  t.life.hits = 20;
  t.hypotheses[0].moving = speed > 0.0;
  t.hypotheses[0].x[kVelocity] = speed;
  t.hypotheses[0].P.bottomRightCorner<3, 3>() = 0.01 * Eigen::Matrix3d::Identity();
  return t;
}

TEST(MoverShares, AreThoseOfTheClassPriorsBeforeTheFirstObject) {
  EXPECT_EQ(MoverShares().of(carPrior(0.2)), 0.2);
}

TEST(MoverShares, FallWithEachObjectAtRestAndRiseWithEachMover) {
  MoverShares shares;
  for (int i = 0; i < 9; ++i) shares.learn(judged(0.0), kMinSpeed);
  EXPECT_NEAR(shares.of(carPrior(0.2)), 0.02, 1e-9);
  for (int i = 0; i < 10; ++i) shares.learn(judged(8.0), kMinSpeed);
  EXPECT_NEAR(shares.of(carPrior(0.2)), 0.51, 1e-3);
}

TEST(MoverShares, CountAConfirmedObjectOnce) {
  MoverShares shares;
  Track t = judged(0.0);
  t.life.hits = 19;
  shares.learn(t, kMinSpeed);
  t.life.hits = 21;
  shares.learn(t, kMinSpeed);
  t.life.hits = 20;
  t.life.once_confirmed = false;
  shares.learn(t, kMinSpeed);
  EXPECT_EQ(shares.of(carPrior(0.2)), 0.2);
}

TEST(MoverShares, AClassThatNeverMovesStaysAtRest) {
  MoverShares shares;
  for (int i = 0; i < 9; ++i) shares.learn(judged(8.0), kMinSpeed);
  EXPECT_EQ(shares.of(carPrior(0.0)), 0.0);
}

TEST(MoverShares, CopiesOfTheBeliefKeepWhatTheyKnew) {
  MoverShares shares;
  const MoverShares before = shares;
  shares.learn(judged(0.0), kMinSpeed);
  EXPECT_EQ(before.of(carPrior(0.2)), 0.2);
  EXPECT_LT(shares.of(carPrior(0.2)), 0.2);
}

}  // namespace
}  // namespace perdure::semantic_filter
