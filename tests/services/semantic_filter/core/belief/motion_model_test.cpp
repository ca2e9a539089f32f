#include "services/semantic_filter/core/belief/motion_model.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "services/semantic_filter/core/belief/track_message.h"
#include "tests/services/semantic_filter/scene.h"

namespace perdure::semantic_filter {
namespace {

/// A moving car after many observations: its yaw is correlated with position and speed.
Track drivingCar() {
  Hypothesis h;
  h.class_name = "car";
  h.weight = 1.0;
  h.moving = true;
  h.x = testing::makeState(20, 0, 0.7, 0, 4, 1.8, 1.5);
  h.x[kVelocity] = 8.0;
  h.P.setIdentity();
  h.P *= 0.04;
  // Not observed recently: a smaller distance is correlated with a lower speed and a yaw to the
  // left.
  h.P(0, kVelocity) = h.P(kVelocity, 0) = -0.03;
  h.P(0, kYaw) = h.P(kYaw, 0) = 0.032;
  h.P(kYaw, kVelocity) = h.P(kVelocity, kYaw) = -0.037;
  h.C(kVelocity, 4) = 0.01;
  Track object;
  object.existence = {0.9, ExistenceEvidence::kPrior, object.as_of};
  object.hypotheses = {h};
  return object;
}

TEST(ExtrapolatedTrack, HasTheFullPredictedCovariance) {
  const Track before = drivingCar();
  const auto& P = before.best().P;
  ASSERT_EQ(Eigen::LLT<Eigen::MatrixXd>(P).info(), Eigen::Success);
  MotionParameters still;
  still.acceleration = still.yaw_walk = 0.0;
  constexpr double kDt = 0.5;
  Eigen::MatrixXd F = Eigen::MatrixXd::Identity(P.rows(), P.cols());
  F.block<3, 3>(0, kVelocity).diagonal().setConstant(kDt);

  const Track later = extrapolated(before, before.as_of + std::chrono::milliseconds(500), still);
  EXPECT_NEAR(later.best().x[0], 24.0, 1e-12);
  EXPECT_LT((later.best().P - F * P * F.transpose()).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_NEAR(later.best().C(0, 4), 0.005, 1e-12);
  EXPECT_EQ(later.as_of, before.as_of);

  // Replacing only the block of the position is not enough: its correlation with the yaw has
  // changed too.
  Matrix7d place_alone = P.topLeftCorner<7, 7>();
  place_alone.topLeftCorner<3, 3>() = later.best().P.topLeftCorner<3, 3>();
  EXPECT_EQ(Eigen::LLT<Matrix7d>(place_alone).info(), Eigen::NumericalIssue);
  const Matrix7d published = toBelief(later, makePriors(), 0.7).best().covariance;
  EXPECT_EQ(Eigen::LLT<Matrix7d>(published).info(), Eigen::Success);
}

TEST(ExtrapolatedTrack, OnlyBecomesLessCertainAtRest) {
  Track object = drivingCar();
  object.hypotheses[0].moving = false;
  const Track later = extrapolated(object, object.as_of + std::chrono::seconds(1), {});
  EXPECT_EQ(later.best().x, object.best().x);
  EXPECT_GT(later.best().P(0, 0), object.best().P(0, 0));
}

TEST(StopSlowHypotheses, ASlowHypothesisStaysInPlaceAndAFastOneMovesOn) {
  const auto left = [](double speed) {
    Track object = drivingCar();
    object.hypotheses[0].x[kVelocity] = speed;
    object.hypotheses[0].P.bottomRightCorner<3, 3>().diagonal().setConstant(0.16);
    stopSlowHypotheses(object, 0.7);
    return object;
  };
  const Track slow = left(0.5);
  ASSERT_EQ(slow.hypotheses.size(), 2u);
  EXPECT_FALSE(slow.best().moving);
  const double fast = fasterThan(slow.hypotheses[1], 0.7);
  EXPECT_NEAR(slow.best().weight, 1.0 - fast, 1e-12);
  EXPECT_NEAR(slow.hypotheses[1].weight, fast, 1e-12);
  // Its position is that of an object at rest: a smaller distance is correlated with a lower speed.
  EXPECT_NEAR(slow.best().x[0], 20.0 + 0.03 / 0.16 * 0.5, 1e-9);
  const Track later = extrapolated(slow, slow.as_of + std::chrono::seconds(30), {});
  EXPECT_EQ(later.best().x, slow.best().x);

  const Track driving = left(8.0);
  ASSERT_EQ(driving.hypotheses.size(), 1u);
  EXPECT_TRUE(driving.best().moving);
  EXPECT_EQ(driving.best().x, drivingCar().best().x);
}

}  // namespace
}  // namespace perdure::semantic_filter
