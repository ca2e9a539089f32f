
#include "services/semantic_filter/core/update/predict.h"

#include <gtest/gtest.h>

#include <cmath>

#include "services/semantic_filter/core/belief/motion_model.h"
#include "services/semantic_filter/core/belief/track_message.h"
#include "services/semantic_filter/core/smoothing/keyframes.h"
#include "tests/services/semantic_filter/scene.h"

namespace perdure::semantic_filter {
namespace {

/// A camera that looks along z from `metres` down its axis.
RigidTransform viewFrom(double metres) {
  RigidTransform T_WC;
  T_WC.p = Eigen::Vector3d(0, 0, metres);
  return T_WC;
}

/// A car 40 m ahead whose box is too large by two deviations, seen from 0 m.
Track biasedCar(const ViewWalk& walk) {
  Hypothesis h;
  h.class_name = "car";
  h.weight = 1.0;
  h.x.head<3>() << 0, 0, 40;
  h.x.segment<3>(kSize) << std::log(4.0), std::log(1.7), std::log(1.5);
  h.P.setZero();
  h.x.segment<4>(kBias).setConstant(0.1);
  Track object;
  object.existence = {0.9, ExistenceEvidence::kPrior, object.as_of};
  object.hypotheses = {h};
  object.views.predicted_from = walk.T_WC;
  return object;
}

ViewWalk walkWith(SideError lasting) {
  ViewWalk walk;
  walk.T_WC = viewFrom(0.0);
  walk.focal = 500.0;
  walk.lasting = lasting;
  walk.bias = {1e9, 1e9, 1e9};  // nothing is forgotten: what is left is the change of size
  return walk;
}

Hypothesis afterDriving(SideError lasting, double metres) {
  ViewWalk walk = walkWith(lasting);
  Track object = biasedCar(walk);
  walk.T_WC = viewFrom(metres);
  predict(object, {}, {}, {}, walk);
  return object.best();
}

TEST(PredictBias, PixelsBecomeALesserShareOfTheBoxAsTheObjectComesNearer) {
  const Hypothesis near = afterDriving({.pixels = 2.0, .relative = 0.0}, 20.0);
  for (int i = 0; i < 4; ++i) EXPECT_NEAR(near.x[kBias + i], 0.05, 1e-6) << "twice as large";
}

TEST(PredictBias, AShareOfTheBoxStaysOne) {
  const Hypothesis near = afterDriving({.pixels = 0.0, .relative = 0.05}, 20.0);
  for (int i = 0; i < 4; ++i) EXPECT_NEAR(near.x[kBias + i], 0.1, 1e-6);
}

TEST(PredictBias, WhatTheViewForgetsComesBackAsDeviation) {
  ViewWalk walk = walkWith({.pixels = 2.0, .relative = 0.03});
  Track object = biasedCar(walk);
  walk.bias = {0.3, 0.01, 0.3};
  walk.T_WC = viewFrom(20.0);  // log 2 of distance at .01 a length: all is forgotten
  predict(object, {}, {}, {}, walk);
  const Hypothesis& h = object.best();
  const Eigen::Vector4d sigma =
      biasSigma(walk.lasting, 500.0 / 20.0 * 5.7 * 2.0 / M_PI, 500.0 / 20.0 * 1.5);
  for (int i = 0; i < 4; ++i) {
    EXPECT_NEAR(h.x[kBias + i], 0.0, 1e-9);
    EXPECT_NEAR(std::sqrt(h.P(kBias + i, kBias + i)), sigma[i], 1e-9);
  }
}

TEST(PredictBias, ADetectorWithoutLastingErrorHasNone) {
  const Hypothesis h = afterDriving({}, 20.0);
  EXPECT_TRUE(h.x.allFinite());
  EXPECT_EQ((h.P.block<4, 4>(kBias, kBias).norm()), 0.0);
}

/// From where it was seen on an earlier visit nothing that stands can hide it.
TEST(Predict, LooksOfAnEarlierVisitVouchThatNothingHidesWhatIsBackInThePicture) {
  ViewWalk walk = walkWith({});
  walk.unmapped_occluder = 0.2;
  walk.screen = {0.15, 0.3, 1e9};
  const CameraModel camera{testing::makeCamera()};
  View view;
  view.camera = &camera;
  const auto screenedAt = [&](double metres_aside) {
    Track object = biasedCar(walk);
    Keyframe seen;
    seen.from = std::make_shared<const FrameView>(view, PoseError{}, fromNanoseconds(1), nullptr);
    object.batch.keyframes.assign(3, std::make_shared<const Keyframe>(seen));
    object.as_of = fromNanoseconds(2);
    object.unused.out_of_view.count = 20;  // frames in which it was out of the picture
    object.views.predicted_from.reset();
    ViewWalk now = walk;
    now.T_WC = seen.from->T_WC;
    now.T_WC.p += now.T_WC.R() * Eigen::Vector3d(metres_aside, 0, 0);
    predict(object, object.as_of + std::chrono::seconds(5), PoseError{}, MotionParameters{}, now);
    return object.detectability.unmapped_occluder;
  };
  EXPECT_LT(screenedAt(0.0), 1e-6);
  EXPECT_LT(screenedAt(0.5), 0.01);
  EXPECT_GT(screenedAt(40.0), 0.19);
}

/// What was found often, or seldom, from here says little of elsewhere.
TEST(Predict, HowOftenItIsFoundFromElsewhereIsNotKnown) {
  ViewWalk walk = walkWith({});
  walk.unmapped_occluder = 0.2;
  walk.hard_to_detect = 0.05;
  walk.screen = {0.15, 0.3, 1e9};
  for (const double now : {0.0, 0.7}) {
    Track object = biasedCar(walk);
    object.detectability.unmapped_occluder = 0.1;
    object.detectability.hard_to_detect = now;
    object.views.predicted_from = walk.T_WC;
    ViewWalk moved = walk;
    predict(object, object.as_of + std::chrono::seconds(1), PoseError{}, MotionParameters{}, moved);
    EXPECT_NEAR(object.detectability.hard_to_detect, now, 1e-12);
    moved.T_WC.p += moved.T_WC.R() * Eigen::Vector3d(40.0, 0, 0);
    predict(object, object.as_of + std::chrono::seconds(1), PoseError{}, MotionParameters{}, moved);
    EXPECT_NEAR(object.detectability.hard_to_detect, 0.05, 0.02);
    object.hypotheses[0].moving = true;
    predict(object, object.as_of + std::chrono::seconds(1), PoseError{}, MotionParameters{}, moved);
    EXPECT_EQ(object.detectability.hard_to_detect, 0.0) << "what drives and is not found is lost";
  }
}

/// A car's place and speed after many looks: what is known of its yaw hangs on both.
Track drivingCar() {
  Hypothesis h;
  h.class_name = "car";
  h.weight = 1.0;
  h.moving = true;
  h.x = testing::makeState(20, 0, 0.7, 0, 4, 1.8, 1.5);
  h.x[kVelocity] = 8.0;
  h.P.setIdentity();
  h.P *= 0.04;
  // Unseen of late: nearer goes with slower, and with a yaw to the left.
  h.P(0, kVelocity) = h.P(kVelocity, 0) = -0.03;
  h.P(0, kYaw) = h.P(kYaw, 0) = 0.032;
  h.P(kYaw, kVelocity) = h.P(kVelocity, kYaw) = -0.037;
  h.C(kVelocity, 4) = 0.01;
  Track object;
  object.existence = {0.9, ExistenceEvidence::kPrior, object.as_of};
  object.hypotheses = {h};
  return object;
}

TEST(MovedOn, CarriesTheCovarianceWithItsCorrelationsAndThePoseErrorWithIt) {
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

  // The place alone would not do: its correlation with the yaw has changed as well.
  Matrix7d place_alone = P.topLeftCorner<7, 7>();
  place_alone.topLeftCorner<3, 3>() = later.best().P.topLeftCorner<3, 3>();
  EXPECT_EQ(Eigen::LLT<Matrix7d>(place_alone).info(), Eigen::NumericalIssue);
  const Matrix7d published = toBelief(later, 0.7).best().covariance;
  EXPECT_EQ(Eigen::LLT<Matrix7d>(published).info(), Eigen::Success);
}

TEST(MovedOn, WhatStandsOnlyBecomesLessCertain) {
  Track object = drivingCar();
  object.hypotheses[0].moving = false;
  const Track later = extrapolated(object, object.as_of + std::chrono::seconds(1), {});
  EXPECT_EQ(later.best().x, object.best().x);
  EXPECT_GT(later.best().P(0, 0), object.best().P(0, 0));
}

TEST(OutOfSight, WhatIsSaidToStandStaysWhereItWasAndWhatDrivesDoesNot) {
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
  // Its place is that of a thing at rest: nearer goes with slower.
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
