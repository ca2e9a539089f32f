#include "services/semantic_filter/core/tracks/mixture_reduction.h"

#include <gtest/gtest.h>

#include <cmath>

#include "services/semantic_filter/core/belief/mixture_ops.h"
#include "tests/services/semantic_filter/scene.h"

namespace perdure::semantic_filter {
namespace {

using testing::makeObject;
using testing::makeState;

class MixtureReduction : public ::testing::Test, protected testing::UsualFrame {};

TEST_F(MixtureReduction, ASlowHypothesisStopsAndItsPlaceIsCorrected) {
  // At a great distance, position and velocity along the ray have one common error.
  Track o = makeObject(1, "car", makeState(20, 0, 0.7, 0, 4, 1.8, 1.5), 0.04);
  Hypothesis& h = o.hypotheses[0];
  h.moving = true;
  h.x[kVelocity] = 0.2;
  h.P.bottomRightCorner<3, 3>().diagonal() << 0.04, 0.01, 0.01;
  h.P(0, kVelocity) = h.P(kVelocity, 0) = 0.03;
  reduceMixture(o, frame);
  ASSERT_FALSE(o.best().moving);
  EXPECT_NEAR(o.best().x[0], 20.0 - 0.03 / 0.04 * 0.2, 1e-9);
  EXPECT_NEAR(o.best().P(0, 0), 0.04 - 0.03 * 0.03 / 0.04, 1e-9);
  EXPECT_EQ(o.best().x.tail<3>(), Eigen::Vector3d::Zero());
}

TEST_F(MixtureReduction, AHypothesisOfImplausibleSizeIsPruned) {
  Track o = makeObject(1, "car", makeState(10, 0, 0.7, 0, 4, 1.8, 1.5), 0.004);
  Hypothesis half = o.hypotheses[0];
  half.x = makeState(5, 0, 0.4, 0, 2, 0.9, 0.75);
  o.hypotheses[0].weight = 0.4;
  half.weight = 0.6;
  o.hypotheses.push_back(half);
  reduceMixture(o, frame);
  ASSERT_EQ(o.hypotheses.size(), 1u);
  EXPECT_NEAR(o.best().x[0], 10.0, 1e-9);
  EXPECT_NEAR(o.existence, 0.9 * 0.4, 1e-9);
}

TEST_F(MixtureReduction, ADominantClassPrunesTheOthers) {
  Track o = makeObject(1, "car", makeState(10, 0, 0.7, 0, 4, 1.8, 1.5), 0.01);
  Hypothesis van = o.best();
  van.class_name = "van";
  van.weight = 0.003;
  o.hypotheses.push_back(van);
  normalise(o, ClassEvidence::kPrior);
  reduceMixture(o, frame);
  EXPECT_EQ(o.hypotheses.size(), 1u);
  EXPECT_EQ(classProbability(o, "car"), 1.0);
}

}  // namespace
}  // namespace perdure::semantic_filter
