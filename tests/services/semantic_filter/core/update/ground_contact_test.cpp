#include "services/semantic_filter/core/update/ground_contact.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/math/gaussian.h"
#include "services/semantic_filter/core/belief/ground_surface.h"
#include "services/semantic_filter/core/tracks/mixture_reduction.h"
#include "tests/services/semantic_filter/ground_scene.h"

namespace perdure::semantic_filter {
namespace {

using testing::kUp;
using testing::makeState;
using testing::standing;
using testing::street;

class UpdateWithGround : public ::testing::Test {
 protected:
  /// The frame has estimated a level street at height `level` (m).
  void know(double level, int things = 8) {
    usual_.priors = standing();
    const auto cars = street([level](double, double) { return level; }, things);
    usual_.frame.ground = std::make_shared<const GroundSurface>(
        cars, BodyPath{}, GroundRoughness{}, kUp, usual_.priors, usual_.parameters.ground);
  }
  /// A car ahead whose range follows only from its size, so its error is along the ray.
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

TEST_F(UpdateWithGround, GivesTheRangeOfACarThatSizeLeavesOpen) {
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

TEST_F(UpdateWithGround, AnUndersideFarBelowTheGroundIsUnlikely) {
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

TEST_F(UpdateWithGround, NothingChangesWithoutGroundOrForAClassThatNeedNotStand) {
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

/// The pose error moves the ground and the object together. Ground contact therefore gives no
/// information about their positions in W, and their common error stays as uncertain as before.
TEST_F(UpdateWithGround, ACommonPoseErrorDoesNotContradict) {
  know(0.0);
  const double sigma = 0.5;
  usual_.frame.pose_error.covariance(5, 5) = sigma * sigma;  // the vertical axis
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

TEST_F(UpdateWithGround, KeepsWhatTheBoxesAloneSay) {
  know(0.0);
  Hypothesis h = farCar(0.0);
  h.x[2] += 0.06;
  h.P *= 0.04;  // standard deviation of 2 % of the distance
  const double alone = h.x[2] - 0.5 * std::exp(h.x[kSize + 2]);
  updateWithGround(h, 99, usual_.frame);
  const double now = h.x[2] - 0.5 * std::exp(h.x[kSize + 2]);
  EXPECT_LT(now, alone);
  EXPECT_NEAR(now + h.ground_contact.above, alone, 1e-9);
  EXPECT_GT(h.ground_contact.variance, 0.0);
}

/// The underside of this hypothesis differs from that in the boxes.
TEST_F(UpdateWithGround, AnotherHypothesisOfTheTrackDoesNotInheritIt) {
  Track o = testing::makeObject(1, "car", testing::makeState(20, 0, 0.7, 0, 4, 1.8, 1.5), 0.04);
  o.life.hits = 3;
  o.history.running_nis = 2.0 * usual_.parameters.motion.start_nis;
  o.hypotheses[0].ground_contact = {0.1, 0.01};
  for (ClassPrior& c : usual_.priors.classes) c.moving = 0.3;
  reduceMixture(o, usual_.frame);
  ASSERT_EQ(o.hypotheses.size(), 3u) << "one that drives off, and one that is misplaced";
  for (const Hypothesis& h : o.hypotheses.read()) {
    const bool itself = !h.moving && h.P(0, 0) < 0.05;
    EXPECT_EQ(h.ground_contact.variance > 0.0, itself);
  }
}

}  // namespace
}  // namespace perdure::semantic_filter
