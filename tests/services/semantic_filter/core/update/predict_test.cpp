#include "services/semantic_filter/core/update/predict.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/math/so3.h"
#include "tests/services/semantic_filter/scene.h"

namespace perdure::semantic_filter {
namespace {

/// A camera `metres` along z that faces along z.
RigidTransform viewFrom(double metres) {
  RigidTransform T_WC;
  T_WC.p = Eigen::Vector3d(0, 0, metres);
  return T_WC;
}

/// A car 40 m ahead whose box is too large by two deviations, observed from 0 m.
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
  walk.bias = {1e9, 1e9, 1e9};  // b does not decay; only the change in size has an effect
  return walk;
}

Hypothesis afterDriving(SideError lasting, double metres) {
  ViewWalk walk = walkWith(lasting);
  Track object = biasedCar(walk);
  walk.T_WC = viewFrom(metres);
  predict(object, {}, {}, {}, walk);
  return object.best();
}

TEST(PredictBias, APixelBecomesASmallerShareOfTheBoxAsTheObjectComesNearer) {
  const Hypothesis near = afterDriving({.pixels = 2.0, .relative = 0.0}, 20.0);
  for (int i = 0; i < 4; ++i) EXPECT_NEAR(near.x[kBias + i], 0.05, 1e-6) << "twice as large";
}

TEST(PredictBias, AShareOfTheBoxStaysTheSame) {
  const Hypothesis near = afterDriving({.pixels = 0.0, .relative = 0.05}, 20.0);
  for (int i = 0; i < 4; ++i) EXPECT_NEAR(near.x[kBias + i], 0.1, 1e-6);
}

TEST(PredictBias, AViewChangeTurnsTheBiasIntoVariance) {
  ViewWalk walk = walkWith({.pixels = 2.0, .relative = 0.03});
  Track object = biasedCar(walk);
  walk.bias = {0.3, 0.01, 0.3};
  walk.T_WC = viewFrom(20.0);  // log 2 of the distance, with a correlation length of 0.01: b decays
                               // completely
  predict(object, {}, {}, {}, walk);
  const Hypothesis& h = object.best();
  const Eigen::Vector4d sigma =
      biasSigma(walk.lasting, 500.0 / 20.0 * 5.7 * 2.0 / M_PI, 500.0 / 20.0 * 1.5);
  for (int i = 0; i < 4; ++i) {
    EXPECT_NEAR(h.x[kBias + i], 0.0, 1e-9);
    EXPECT_NEAR(std::sqrt(h.P(kBias + i, kBias + i)), sigma[i], 1e-9);
  }
}

TEST(PredictBias, ADetectorWithoutLastingErrorHasNoBias) {
  const Hypothesis h = afterDriving({}, 20.0);
  EXPECT_TRUE(h.x.allFinite());
  EXPECT_EQ((h.P.block<4, 4>(kBias, kBias).norm()), 0.0);
}

/// An unmapped object at rest cannot hide the track in directions from which it was detected, up to
/// the distance of that detection.
TEST(Predict, DirectionsOfDetectionsExcludeAnUnmappedOccluder) {
  ViewWalk walk = walkWith({});
  walk.unmapped_occluder = 0.2;
  walk.occluder = {0.15, 1e9, 1e9};
  walk.detectability = {0.15, 0.3, 1e9};
  const Track car = biasedCar(walk);
  const Eigen::Vector3d place = car.best().x.head<3>();
  constexpr double kAzimuth = 0.1;
  const auto occludedAt = [&](double turn, double metres, double seen_at) {
    Track object = car;
    if (seen_at > 0.0) {
      addDirection(object.detectability.seen_from, kAzimuth, seen_at);
    }
    object.views.predicted_from.reset();
    ViewWalk now = walk;
    now.T_WC.p = place - rotationAboutZ(kAzimuth + turn) * Eigen::Vector3d(metres, 0.0, 0.0);
    predict(object, object.as_of + std::chrono::seconds(5), PoseError{}, MotionParameters{}, now);
    return object.detectability.unmapped_occluder;
  };
  EXPECT_LT(occludedAt(0.0, 20.0, 20.0), 1e-6);
  EXPECT_LT(occludedAt(0.0, 8.0, 20.0), 1e-6) << "nearer, fewer things are between";
  EXPECT_NEAR(occludedAt(0.0, 40.0, 20.0), 0.2 * (1.0 - std::pow(0.5, 1.0 / 0.3)), 1e-3);
  EXPECT_NEAR(occludedAt(M_PI, 20.0, 20.0), 0.2, 1e-6);
  EXPECT_NEAR(occludedAt(0.0, 20.0, 0.0), 0.2, 1e-6) << "nothing is known of any direction";
}

/// A hedge that hides an object hides it from a whole side, at any distance.
TEST(Predict, AnUnmappedOccluderStaysWhileTheDirectionStays) {
  ViewWalk walk = walkWith({});
  walk.unmapped_occluder = 0.2;
  walk.occluder = {1.0, 1e9, 1e9};
  walk.detectability = {0.15, 0.3, 1e9};
  const auto after = [&](const Eigen::Vector3d& step) {
    Track object = biasedCar(walk);
    object.detectability.unmapped_occluder = 1.0;
    ViewWalk moved = walk;
    moved.T_WC.p += step;
    predict(object, object.as_of + std::chrono::seconds(1), PoseError{}, MotionParameters{}, moved);
    return object.detectability.unmapped_occluder;
  };
  EXPECT_GT(after({0, 0, 30}), 0.99) << "from 40 m to 10 m, in one direction";
  EXPECT_NEAR(after({40, 0, 40}), 0.2 + 0.8 * std::exp(-std::sqrt(2.0)), 1e-6) << "from the side";
}

/// Its detection rate from here gives little information about other viewpoints.
TEST(Predict, DetectabilityFromAnotherViewpointReturnsToItsPrior) {
  ViewWalk walk = walkWith({});
  walk.unmapped_occluder = 0.2;
  walk.hard_to_detect = 0.05;
  walk.detectability = {0.15, 0.3, 1e9};
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

}  // namespace
}  // namespace perdure::semantic_filter
