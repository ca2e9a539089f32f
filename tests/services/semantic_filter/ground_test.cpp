
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "common/math/gaussian.h"
#include "services/semantic_filter/core/belief/ground_surface.h"
#include "services/semantic_filter/core/tracks/lifecycle.h"
#include "services/semantic_filter/core/tracks/mixture_reduction.h"
#include "services/semantic_filter/core/update/ground_contact.h"
#include "tests/services/semantic_filter/scene.h"

namespace perdure::semantic_filter {
namespace {

using testing::makeObject;
using testing::makeState;

const Eigen::Vector3d kUp = Eigen::Vector3d::UnitZ();

ClassPriors standing() {
  ClassPriors priors = testing::makePriors();
  for (auto& c : priors.classes) c.stands = 0.97;
  return priors;
}

/// A car whose underside is at `height`, seen from several sides.
Track carAt(ObjectId id, double x, double y, double height) {
  Track car = makeObject(id, "car", makeState(x, y, height + 0.75, 0.0, 4.2, 1.75, 1.5), 0.01);
  car.hypotheses[0].ground_contact.variance = 0.02 * 0.02;
  return car;
}

/// A street on both sides of x, with undersides at `height(x, y)`.
template <class Height>
std::vector<Track> street(Height height, int things = 8) {
  std::vector<Track> cars;
  for (int i = 0; i < things; ++i) {
    const double x = 5.0 + 4.0 * i, y = i % 2 == 0 ? 4.0 : -5.0;
    cars.push_back(carAt(static_cast<ObjectId>(i + 1), x, y, height(x, y)));
  }
  return cars;
}

GroundSurface groundOf(const std::vector<Track>& objects) {
  return {objects, BodyPath{}, GroundRoughness{}, kUp, standing(), GroundParameters{}};
}

class Standing : public ::testing::Test {
 protected:
  /// The frame knows a level street at `level`.
  void know(double level, int things = 8) {
    usual_.priors = standing();
    const auto cars = street([level](double, double) { return level; }, things);
    usual_.frame.ground = std::make_shared<const GroundSurface>(
        cars, BodyPath{}, GroundRoughness{}, kUp, usual_.priors, usual_.parameters.ground);
  }
  /// A car ahead of which size alone says how far it is: it is placed along the ray to it.
  static Hypothesis farCar(double range_error) {
    const double truth = 30.0, camera = 1.6;
    Hypothesis h;
    h.class_name = "car";
    h.weight = 1.0;
    const double scale = 1.0 + range_error;
    h.x = makeState(truth * scale, 3.0 * scale, camera + (0.75 - camera) * scale, 0.0, 4.2 * scale,
                    1.75 * scale, 1.5 * scale);
    h.P.setZero();
    Eigen::Matrix<double, kGeometry, 1> along = Eigen::Matrix<double, kGeometry, 1>::Zero();
    along.head<3>() << truth, 3.0, 0.75 - camera;
    along.tail<3>().setOnes();
    h.P.topLeftCorner<kGeometry, kGeometry>() = 0.1 * 0.1 * along * along.transpose();
    h.P.diagonal().head<kGeometry>().array() += 1e-4;
    return h;
  }

  testing::UsualFrame usual_;
};

TEST(GroundSurface, IsAsHighAsWhatStandsAroundIt) {
  const auto at = groundOf(street([](double, double) { return -0.4; })).below({15, 1, 0.8}, 0);
  ASSERT_TRUE(at);
  EXPECT_NEAR(at->mean, -0.4, 1e-3);
  EXPECT_LT(std::sqrt(at->variance), 0.12);
}

TEST(GroundSurface, GoesOnWithItsSlopeAndIsLessSureThere) {
  const GroundSurface ground =
      groundOf(street([](double x, double y) { return 0.02 * x - 0.01 * y; }));
  const auto near = ground.below({20, 0, 0}, 0), far = ground.below({55, 2, 0}, 0);
  ASSERT_TRUE(near && far);
  EXPECT_NEAR(near->mean, 0.40, 0.02);
  EXPECT_NEAR(far->mean, 1.08, 2.0 * std::sqrt(far->variance));
  EXPECT_GT(far->mean, 0.7) << "a street that rises is not level beyond the last thing";
  EXPECT_GT(far->variance, 4.0 * near->variance);
}

TEST(GroundSurface, IsNotKnownFromFewOrFarThings) {
  const auto flat = [](double, double) { return 0.0; };
  EXPECT_FALSE(groundOf(street(flat, 2)).below({8, 0, 0}, 0));
  EXPECT_TRUE(groundOf(street(flat, 3)).below({8, 0, 0}, 0));
  EXPECT_FALSE(groundOf(street(flat, 3)).below({200, 0, 0}, 0));
  EXPECT_FALSE(groundOf(street(flat, 3)).below({8, 0, 0}, 2)) << "a thing does not tell itself";
}

TEST(GroundSurface, OneThatStandsOnSomethingIsNotHeard) {
  auto cars = street([](double, double) { return 0.0; });
  cars[3] = carAt(4, 17, -5, 1.2);
  const auto at = groundOf(cars).below({16, 0, 0}, 0);
  ASSERT_TRUE(at);
  EXPECT_NEAR(at->mean, 0.0, 0.02);
}

TEST(GroundSurface, WhatMovesOrMayNotExistOrNeedNotStandSaysNothing) {
  auto cars = street([](double, double) { return 0.0; }, 5);
  cars[0].hypotheses[0].moving = true;
  cars[1].existence = {0.3, ExistenceEvidence::kPrior, cars[1].as_of};
  cars[2].hypotheses[0].class_name = kOtherClass;
  EXPECT_FALSE(groundOf(cars).below({8, 0, 0}, 0));
}

/// Of a body `height` above a ground that it went along by `metres`, rising by `slope`.
GroundSurface groundOfBody(double height, double metres, double slope,
                           const std::vector<Track>& cars) {
  BodyPath path;
  for (double x = -metres; x <= 0.0; x += 0.5) path.go({x, 0, slope * x + height});
  GroundParameters parameters;
  parameters.body_height_m = height;
  return {cars, path, GroundRoughness{}, kUp, standing(), parameters};
}

TEST(GroundSurface, IsBelowABodyOfKnownHeightFromTheFirstFrameOn) {
  const GroundSurface ground = groundOfBody(1.5, 0.0, 0.0, {});
  const auto near = ground.below({3, 0, 0}, 0), far = ground.below({30, 0, 0}, 0);
  ASSERT_TRUE(near && far);
  EXPECT_NEAR(near->mean, 0.0, 1e-3);
  EXPECT_GT(std::sqrt(near->variance), GroundParameters{}.body_height_sigma_m);
  EXPECT_LT(std::sqrt(near->variance), 0.15);
  EXPECT_GT(std::sqrt(far->variance), 0.5) << "whether it rises is not known yet";
  EXPECT_FALSE(ground.below({200, 0, 0}, 0));
  EXPECT_TRUE(ground.below({3, 0, 0}, 1)) << "the body is none of the things";
}

TEST(GroundSurface, GoesOnAsTheBodyCame) {
  const auto ahead = groundOfBody(1.5, 30.0, 0.05, {}).below({20, 0, 0}, 0);
  const auto level = groundOfBody(1.5, 0.0, 0.05, {}).below({20, 0, 0}, 0);
  ASSERT_TRUE(ahead && level);
  EXPECT_NEAR(ahead->mean, 1.0, 2.0 * std::sqrt(ahead->variance));
  EXPECT_GT(ahead->mean, 0.5);
  EXPECT_LT(ahead->variance, 0.7 * level->variance);
}

/// All places of the path err alike where the height that was told is wrong.
TEST(GroundSurface, ThingsMendAHeightThatIsWrong) {
  BodyPath path;
  for (double x = -30.0; x <= 0.0; x += 0.5) path.go({x, 0, 1.5});
  GroundParameters parameters;
  parameters.body_height_m = 1.3;
  const auto cars = street([](double, double) { return 0.0; });
  const GroundSurface ground(cars, path, GroundRoughness{}, kUp, standing(), parameters);
  const auto at = ground.below({15, 0, 0}, 0);
  ASSERT_TRUE(at);
  EXPECT_NEAR(at->mean, 0.0, 0.06);
}

TEST(GroundSurface, LearnsHowEvenItIs) {
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

TEST_F(Standing, TellsHowFarACarIsWhereSizeDoesNot) {
  know(0.0);
  for (const double error : {-0.12, 0.0, 0.12}) {
    Hypothesis h = farCar(error);
    const double before = std::sqrt(h.P(0, 0));
    EXPECT_GT(updateWithGround(h, 99, usual_.frame), -1.0);
    const double after = std::sqrt(h.P(0, 0));
    EXPECT_LT(after, before);
    EXPECT_LT(std::abs(h.x[0] - 30.0), std::abs(error) * 30.0 + 1e-6);
    EXPECT_LT(std::abs(h.x[0] - 30.0), 2.5 * after) << error;
    EXPECT_TRUE(isCovariance(h.P.topLeftCorner<kGeometry, kGeometry>()));
  }
}

TEST_F(Standing, WhatSeemsToStandFarBelowIsUnlikelyThere) {
  know(0.0);
  Hypothesis on = farCar(0.0), below = on;
  below.x[2] -= 1.5;
  const Hypothesis as_it_was = below;
  const double of_on = updateWithGround(on, 99, usual_.frame);
  const double of_below = updateWithGround(below, 99, usual_.frame);
  EXPECT_GT(of_on, of_below + 3.0);
  EXPECT_GE(of_below, std::log(1.0 - 0.97) - 1e-9) << "it may be one of those that do not stand";
  EXPECT_TRUE(below.x == as_it_was.x) << "and is not pulled up";
}

TEST_F(Standing, WithoutGroundOrForWhatNeedNotStandNothingChanges) {
  Hypothesis h = farCar(0.1);
  const Hypothesis before = h;
  EXPECT_EQ(updateWithGround(h, 99, usual_.frame), 0.0);
  know(0.0, 2);
  EXPECT_EQ(updateWithGround(h, 99, usual_.frame), 0.0);
  know(0.0);
  for (auto& c : usual_.priors.classes) c.stands = 0.0;
  EXPECT_EQ(updateWithGround(h, 99, usual_.frame), 0.0);
  EXPECT_TRUE(h.x == before.x && h.P == before.P);
}

/// The pose's error moves the ground and what stands on it alike: against it nothing is learned of
/// where both are in W, and what both share stays as uncertain as it was.
TEST_F(Standing, ACommonPoseErrorIsNoContradiction) {
  know(0.0);
  const double sigma = 0.5;
  usual_.frame.pose_error.covariance(5, 5) = sigma * sigma;  // up
  usual_.frame.pose_error.covariance.diagonal().head<5>().setConstant(1e-8);
  Hypothesis h = farCar(0.1), exact = h;
  h.P(2, 2) += sigma * sigma;
  h.C(2, 5) = sigma * sigma;
  updateWithGround(h, 99, usual_.frame);
  usual_.frame.pose_error.covariance.setZero();
  updateWithGround(exact, 99, usual_.frame);
  EXPECT_NEAR(h.x[0], exact.x[0], 0.02) << "seen from the body it is the same";
  EXPECT_NEAR(h.P(2, 2), exact.P(2, 2) + sigma * sigma, 0.02 * sigma * sigma);
  EXPECT_NEAR(h.C(2, 5), sigma * sigma, 0.02 * sigma * sigma);
}

TEST_F(Standing, KeepsWhatTheLooksAloneSaid) {
  know(0.0);
  Hypothesis h = farCar(0.0);
  h.x[2] += 0.06;
  h.P *= 0.04;  // placed to 2 % of its distance
  const double alone = h.x[2] - 0.5 * std::exp(h.x[kSize + 2]);
  updateWithGround(h, 99, usual_.frame);
  const double now = h.x[2] - 0.5 * std::exp(h.x[kSize + 2]);
  EXPECT_LT(now, alone);
  EXPECT_NEAR(now + h.ground_contact.above, alone, 1e-9);
  EXPECT_GT(h.ground_contact.variance, 0.0);
}

/// Its underside is not the one that the looks told.
TEST_F(Standing, WhatATwinOfItDoesIsNotToldByItsLooks) {
  Track o = testing::makeObject(1, "car", testing::makeState(20, 0, 0.7, 0, 4, 1.8, 1.5), 0.04);
  o.life.hits = 3;
  o.history.running_nis = 2.0 * usual_.parameters.motion.start_nis;
  o.hypotheses[0].ground_contact = {0.1, 0.01};
  for (ClassPrior& c : usual_.priors.classes) c.moving = 0.3;
  reduceMixture(o, usual_.priors, usual_.parameters);
  ASSERT_EQ(o.hypotheses.size(), 3u) << "one that drives off, and one that is misplaced";
  for (const Hypothesis& h : o.hypotheses.read()) {
    const bool itself = !h.moving && h.P(0, 0) < 0.05;
    EXPECT_EQ(h.ground_contact.variance > 0.0, itself);
  }
}

}  // namespace
}  // namespace perdure::semantic_filter
