#include "services/semantic_filter/core/belief/ground_surface.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/services/semantic_filter/ground_scene.h"

namespace perdure::semantic_filter {
namespace {

using testing::carAt;
using testing::kUp;
using testing::standing;
using testing::street;

GroundSurface groundOf(const std::vector<Track>& objects) {
  return {objects, BodyPath{}, GroundRoughness{}, kUp, standing(), GroundParameters{}};
}

TEST(GroundSurface, IsAsHighAsTheUndersidesAroundIt) {
  const auto at = groundOf(street([](double, double) { return -0.4; })).below({15, 1, 0.8}, 0);
  ASSERT_TRUE(at);
  EXPECT_NEAR(at->mean, -0.4, 1e-3);
  EXPECT_LT(std::sqrt(at->variance), 0.12);
}

TEST(GroundSurface, ContinuesWithItsSlopeAndIsLessCertainThere) {
  const GroundSurface ground =
      groundOf(street([](double x, double y) { return 0.02 * x - 0.01 * y; }));
  const auto near = ground.below({20, 0, 0}, 0), far = ground.below({55, 2, 0}, 0);
  ASSERT_TRUE(near && far);
  EXPECT_NEAR(near->mean, 0.40, 0.02);
  EXPECT_NEAR(far->mean, 1.08, 2.0 * std::sqrt(far->variance));
  EXPECT_GT(far->mean, 0.7) << "a street that rises is not level beyond the last object";
  EXPECT_GT(far->variance, 4.0 * near->variance);
}

TEST(GroundSurface, IsNotKnownFromFewOrFarObjects) {
  const auto flat = [](double, double) { return 0.0; };
  EXPECT_FALSE(groundOf(street(flat, 2)).below({8, 0, 0}, 0));
  EXPECT_TRUE(groundOf(street(flat, 3)).below({8, 0, 0}, 0));
  EXPECT_FALSE(groundOf(street(flat, 3)).below({200, 0, 0}, 0));
  EXPECT_FALSE(groundOf(street(flat, 3)).below({8, 0, 0}, 2))
      << "an object does not contribute to itself";
}

TEST(GroundSurface, AnObjectThatStandsOnSomethingElseIsLeftOut) {
  auto cars = street([](double, double) { return 0.0; });
  cars[3] = carAt(4, 17, -5, 1.2);
  const auto at = groundOf(cars).below({16, 0, 0}, 0);
  ASSERT_TRUE(at);
  EXPECT_NEAR(at->mean, 0.0, 0.02);
}

TEST(GroundSurface, MovingOrDoubtfulObjectsOrThoseThatNeedNotStandDoNotContribute) {
  auto cars = street([](double, double) { return 0.0; }, 5);
  cars[0].hypotheses[0].moving = true;
  cars[1].existence = {0.3, ExistenceEvidence::kPrior, cars[1].as_of};
  cars[2].hypotheses[0].class_name = kOtherClass;
  EXPECT_FALSE(groundOf(cars).below({8, 0, 0}, 0));
}

/// The ground below a body at `height` (m) that travelled `metres` along it, rising by `slope`.
GroundSurface groundOfBody(double height, double metres, double slope,
                           const std::vector<Track>& cars) {
  BodyPath path;
  for (double x = -metres; x <= 0.0; x += 0.5) path.advance({x, 0, slope * x + height});
  GroundParameters parameters;
  parameters.body_height_m = height;
  return {cars, path, GroundRoughness{}, kUp, standing(), parameters};
}

TEST(GroundSurface, IsKnownFromTheBodysHeightInTheFirstFrame) {
  const GroundSurface ground = groundOfBody(1.5, 0.0, 0.0, {});
  const auto near = ground.below({3, 0, 0}, 0), far = ground.below({30, 0, 0}, 0);
  ASSERT_TRUE(near && far);
  EXPECT_NEAR(near->mean, 0.0, 1e-3);
  EXPECT_GT(std::sqrt(near->variance), GroundParameters{}.body_height_sigma_m);
  EXPECT_LT(std::sqrt(near->variance), 0.15);
  EXPECT_GT(std::sqrt(far->variance), 0.5) << "whether it rises is not known yet";
  EXPECT_FALSE(ground.below({200, 0, 0}, 0));
  EXPECT_TRUE(ground.below({3, 0, 0}, 1)) << "the body is none of the objects";
}

TEST(GroundSurface, ContinuesTheSlopeOfTheBodysPath) {
  const auto ahead = groundOfBody(1.5, 30.0, 0.05, {}).below({20, 0, 0}, 0);
  const auto level = groundOfBody(1.5, 0.0, 0.05, {}).below({20, 0, 0}, 0);
  ASSERT_TRUE(ahead && level);
  EXPECT_NEAR(ahead->mean, 1.0, 2.0 * std::sqrt(ahead->variance));
  EXPECT_GT(ahead->mean, 0.5);
  EXPECT_LT(ahead->variance, 0.7 * level->variance);
}

/// If the given height is wrong, all points of the path have the same error.
TEST(GroundSurface, ObjectsCorrectAWrongHeightOfTheBody) {
  BodyPath path;
  for (double x = -30.0; x <= 0.0; x += 0.5) path.advance({x, 0, 1.5});
  GroundParameters parameters;
  parameters.body_height_m = 1.3;
  const auto cars = street([](double, double) { return 0.0; });
  const GroundSurface ground(cars, path, GroundRoughness{}, kUp, standing(), parameters);
  const auto at = ground.below({15, 0, 0}, 0);
  ASSERT_TRUE(at);
  EXPECT_NEAR(at->mean, 0.0, 0.06);
}

TEST(GroundSurface, LearnsHowUnevenItIs) {
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  const auto learned = [&](double times) {
    GroundRoughness roughness_scale;
    const GroundHeight others{0.0, 0.15 * 0.15 + 0.03 * 0.03, 0.15 * 0.15};
    const double own = 0.06 * 0.06;
    double ratio = 1.0;
    for (int i = 0; i < 400; ++i) {
      GroundHeight now = others;
      now.uneven *= ratio, now.variance = others.variance - others.uneven + now.uneven;
      const double sigma = std::sqrt(times * others.uneven + others.variance - others.uneven + own);
      roughness_scale.learn(sigma * normal(random), now, own, ratio, 1.0);
      ratio = roughness_scale.ratio(GroundParameters{}.prior_objects);
    }
    return ratio;
  };
  EXPECT_NEAR(learned(1.0), 1.0, 0.25);
  EXPECT_LT(learned(0.0), 0.15);
  EXPECT_NEAR(learned(4.0), 4.0, 1.2);
}

}  // namespace
}  // namespace perdure::semantic_filter
