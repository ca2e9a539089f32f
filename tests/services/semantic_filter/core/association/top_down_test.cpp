// Top-down answers: the effects that they may have on a track, and those that they must not have.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "services/semantic_filter/core/association/score.h"
#include "services/semantic_filter/core/tracks/lifecycle.h"
#include "services/semantic_filter/core/update/track_update.h"
#include "services/semantic_filter/core/visibility/predicted_box.h"
#include "tests/services/semantic_filter/scene.h"

namespace perdure::semantic_filter {
namespace {

using testing::makeCamera;
using testing::makeModelInfo;
using testing::makePriors;
using testing::makeState;

class TopDown : public ::testing::Test {
 protected:
  TopDown() {
    frame.view.camera = &camera;
    frame.view.T_WB = RigidTransform(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0, 0, 1.2));
    frame.model = &model;
    frame.priors = &priors;
    frame.parameters = &parameters;
  }
  Track object(double existence) const {
    Track o;
    o.id = 1;
    o.existence = {existence, ExistenceEvidence::kPrior, o.as_of};
    Hypothesis h;
    h.class_name = "car";
    h.weight = 1.0;
    h.x = makeState(15.0, 2.0, 0.75, 0.5, 4.2, 1.75, 1.5);
    h.P.setZero();
    h.P.diagonal().head<7>() << 0.3, 0.3, 0.02, 0.03, 0.01, 0.01, 0.01;
    o.hypotheses = {h};
    return o;
  }
  /// An observation without a box; `nats`: log-likelihood of the top-down answer, if there was one.
  void lookWithoutBox(Track& o, std::optional<double> nats) const {
    TrackVisibility visibility;
    visibility.fraction = 1.0;
    TrackScore seen = scoreTrack(o, visibility, {}, frame);
    if (nats) applyTopDown(seen, o, std::vector<double>(model.classes.size(), *nats), frame);
    update(o, seen, Eigen::VectorXd(0), {}, frame);
  }

  CameraModel camera{makeCamera()};
  Model model = makeModel(makeModelInfo());
  ClassPriors priors = makePriors();
  Parameters parameters;
  FrameContext frame;
};

TEST_F(TopDown, ALogLikelihoodOfZeroIsAPlainMiss) {
  Track plain = object(0.9), asked = object(0.9);
  lookWithoutBox(plain, {});
  lookWithoutBox(asked, 0.0);
  EXPECT_NEAR(plain.existence, asked.existence, 1e-12);
}

TEST_F(TopDown, FollowsTheLikelihoodOfTheMissAndTheAnswerTogether) {
  Track o = object(0.9);
  o.history.existence_when_detected = 0.99;
  TrackVisibility visibility;
  visibility.fraction = 1.0;
  const double D = scoreTrack(o, visibility, {}, frame).hypotheses[0].detection_probability;
  lookWithoutBox(o, std::log(3.0));
  const double A = (1.0 - D) * 3.0;  // v = 1: (1 - P_D) rho
  EXPECT_NEAR(o.existence, 0.9 * A / (0.1 + 0.9 * A), 1e-9);
}

TEST_F(TopDown, DeletesAFalseTrackSoonerThanMissesAlone) {
  Track plain = object(0.95), asked = object(0.95);
  plain.detectability.unmapped_occluder = asked.detectability.unmapped_occluder = 0.2;
  for (int i = 0; i < 4; ++i) {
    lookWithoutBox(plain, {});
    lookWithoutBox(asked, -0.3);
    EXPECT_LT(asked.existence, plain.existence);
  }
}

TEST_F(TopDown, NeverRaisesExistenceAboveThatOfTheLastHit) {
  Track o = object(0.7);
  for (int i = 0; i < 30; ++i) lookWithoutBox(o, 5.0);
  EXPECT_NEAR(o.existence, 0.7, 1e-9) << "it was never seen by itself";
  o = object(0.7);
  o.history.existence_when_detected = 0.8;
  for (int i = 0; i < 30; ++i) lookWithoutBox(o, 5.0);
  EXPECT_LE(o.existence, 0.8 + 1e-9);
  EXPECT_GT(o.existence, 0.7) << "it gives back what misses took";
}

TEST_F(TopDown, IsNoHitConfirmsNothingAndMovesNothing) {
  Track o = object(0.94);
  o.history.existence_when_detected = 0.98;
  const Hypothesis before = o.best();
  std::vector<Track> all;
  for (int i = 0; i < 20; ++i) lookWithoutBox(o, 5.0);
  EXPECT_GT(o.existence, parameters.tracks.confirm);
  EXPECT_EQ(o.life.hits, 0U);
  EXPECT_EQ(o.life.visible_misses, 20U);
  EXPECT_TRUE(o.best().x == before.x);
  EXPECT_TRUE(o.best().P == before.P);
  all.push_back(o);
  confirmAndDelete(all, frame);
  ASSERT_EQ(all.size(), 1U);
  EXPECT_FALSE(all[0].life.confirmed);
}

TEST_F(TopDown, EveryPredictedBoxIsAValidMessage) {
  constexpr double kWire = 1e6;  // px; the wire refuses a message with sides further away
  std::mt19937 random(3);
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  FrameInput now;
  now.view = frame.view;
  now.model = std::make_shared<const Model>(model);
  ComingFrame coming{frame.view, 0.1};
  int sent = 0;
  for (int i = 0; i < 5000; ++i) {
    Track o = object(0.9);
    o.hypotheses[0].x.head<3>() << 3.0 * u(random), 3.0 * u(random), 1.2 + u(random);
    coming.view.T_WB.p.x() = u(random);
    const auto prediction = predictionOf(o, now, coming);
    if (!prediction) continue;
    ++sent;
    const Box& b = prediction->box;
    for (const double side : {b.x1, b.y1, b.x2, b.y2}) ASSERT_LT(std::abs(side), kWire);
    for (const double speed : prediction->velocity) ASSERT_LT(std::abs(speed), kWire);
    for (const double sigma : prediction->side_sigma) ASSERT_TRUE(std::isfinite(sigma));
  }
  EXPECT_GT(sent, 500);
}

TEST_F(TopDown, SaysNothingAboutAClassThatTheModelDoesNotKnow) {
  Track plain = object(0.9), asked = object(0.9);
  plain.hypotheses[0].class_name = asked.hypotheses[0].class_name = "zeppelin";
  lookWithoutBox(plain, {});
  lookWithoutBox(asked, 5.0);
  EXPECT_EQ(static_cast<double>(plain.existence), static_cast<double>(asked.existence));
}

TEST_F(TopDown, RefusesAnswersOfAWrongLengthOrNotANumber) {
  Detection d;
  d.primed = true;
  d.activations = {0.0F, 1.0F};
  EXPECT_FALSE(topDownRatios(d, model, parameters.clutter));
  d.activations.assign(model.classes.size() + 1, NAN);
  EXPECT_FALSE(topDownRatios(d, model, parameters.clutter));
  d.activations.assign(model.classes.size() + 1, 99.0F);
  d.activations[0] = 0.0F;
  const auto ratios = topDownRatios(d, model, parameters.clutter);
  ASSERT_TRUE(ratios);
  EXPECT_LE(ratios->front(), parameters.clutter.max_log_ratio);
}

}  // namespace
}  // namespace perdure::semantic_filter
