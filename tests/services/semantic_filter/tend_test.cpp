
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "services/semantic_filter/core/belief/mixture_ops.h"
#include "services/semantic_filter/core/belief/pose_correlation.h"
#include "services/semantic_filter/core/belief/track_message.h"
#include "services/semantic_filter/core/filter.h"
#include "services/semantic_filter/core/tracks/cuboid_fit.h"
#include "services/semantic_filter/core/tracks/lifecycle.h"
#include "services/semantic_filter/core/tracks/mixture_reduction.h"
#include "services/semantic_filter/core/tracks/reinitialise.h"
#include "tests/services/semantic_filter/scene.h"

namespace perdure::semantic_filter {
namespace {

using testing::makeObject;
using testing::makeState;

class Tending : public ::testing::Test, protected testing::UsualFrame {};

TEST_F(Tending, WhatStandsStillWasWronglyPlacedNotMoving) {
  // Seen from far, the place along the ray and the speed along it are one error.
  Track o = makeObject(1, "car", makeState(20, 0, 0.7, 0, 4, 1.8, 1.5), 0.04);
  Hypothesis& h = o.hypotheses[0];
  h.moving = true;
  h.x[kVelocity] = 0.2;
  h.P.bottomRightCorner<3, 3>().diagonal() << 0.04, 0.01, 0.01;
  h.P(0, kVelocity) = h.P(kVelocity, 0) = 0.03;
  reduceMixture(o, priors, parameters);
  ASSERT_FALSE(o.best().moving);
  EXPECT_NEAR(o.best().x[0], 20.0 - 0.03 / 0.04 * 0.2, 1e-9);
  EXPECT_NEAR(o.best().P(0, 0), 0.04 - 0.03 * 0.03 / 0.04, 1e-9);
  EXPECT_EQ(o.best().x.tail<3>(), Eigen::Vector3d::Zero());
}

TEST_F(Tending, WhatNoLongerHasTheSizeOfItsClassIsDropped) {
  Track o = makeObject(1, "car", makeState(10, 0, 0.7, 0, 4, 1.8, 1.5), 0.004);
  Hypothesis half = o.hypotheses[0];
  half.x = makeState(5, 0, 0.4, 0, 2, 0.9, 0.75);
  o.hypotheses[0].weight = 0.4;
  half.weight = 0.6;
  o.hypotheses.push_back(half);
  reduceMixture(o, priors, parameters);
  ASSERT_EQ(o.hypotheses.size(), 1u);
  EXPECT_NEAR(o.best().x[0], 10.0, 1e-9);
  EXPECT_NEAR(o.existence, 0.9 * 0.4, 1e-9);
}

TEST_F(Tending, ADominantClassEndsTheOthers) {
  Track o = makeObject(1, "car", makeState(10, 0, 0.7, 0, 4, 1.8, 1.5), 0.01);
  Hypothesis van = o.best();
  van.class_name = "van";
  van.weight = 0.003;
  o.hypotheses.push_back(van);
  normalise(o, ClassEvidence::kPrior);
  reduceMixture(o, priors, parameters);
  EXPECT_EQ(o.hypotheses.size(), 1u);
  EXPECT_EQ(classProbability(o, "car"), 1.0);
}

TEST_F(Tending, BirthRecoversSizeAndPlaceFromAnExactBoxAtTheTrueYaw) {
  frame.view.T_WB = RigidTransform(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0, 0, 1.2));
  const State truth = makeState(14.0, 3.0, 0.75, 0.6, 4.2, 1.75, 1.5);  // the prior's mean size
  const auto s = projectCuboid(truth, frame.view)->sides;
  Detection d;
  d.box = {s[0], s[1], s[2], s[3]};
  d.activations = {0, 2, -2, -2, -2};
  const auto e = *makeBoxDetection(d, model, camera.width(), camera.height(), parameters.box, {});
  const auto fit = fitCuboid(e, priors.of("car"), 0.6, 0.05, std::nullopt, frame);
  ASSERT_TRUE(fit);
  EXPECT_LT((fit->hypothesis.x - truth).head<3>().norm(), 0.05);
  EXPECT_LT((fit->hypothesis.x - truth).segment<3>(kSize).norm(), 0.01);
  EXPECT_LT(fit->cost, 0.1);  // what is left is the weak pull to the start
  const double depth_sigma = std::sqrt(fit->hypothesis.P(0, 0));
  EXPECT_GT(depth_sigma, 0.05 * 14.0);  // no better than the size prior allows
  EXPECT_LT(depth_sigma, 0.2 * 14.0);
}

TEST_F(Tending, WhatLostItsShapeBeginsAgainFromItsOwnBoxAsWhatItWas) {
  frame.view.T_WB = RigidTransform(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0, 0, 1.2));
  const State truth = makeState(14.0, 3.0, 0.75, 0.6, 4.2, 1.75, 1.5);
  const auto s = projectCuboid(truth, frame.view)->sides;
  Detection d;
  d.box = {s[0], s[1], s[2], s[3]};
  d.activations = {0, 1.5F, -2, -2, 2};  // this once it looks more like a van
  const auto e = *makeBoxDetection(d, model, camera.width(), camera.height(), parameters.box, {});

  Track o = makeObject(7, "car", makeState(7.0, 1.5, 0.9, 0.6, 2.1, 0.87, 0.75), 0.001);
  o.life.once_confirmed = true;
  o.life.hits = 40;
  const double existence = o.existence;
  const auto pmf = classShares(o);
  reduceMixture(o, priors, parameters);
  ASSERT_TRUE(o.hypotheses.empty());
  ASSERT_TRUE(reinitialise(o, pmf, e, std::nullopt, frame));
  EXPECT_EQ(o.id, 7u);
  EXPECT_EQ(o.life.hits, 40u);
  EXPECT_EQ(o.existence, existence);
  EXPECT_NEAR(classProbability(o, "car"), 1.0, 1e-12);
  EXPECT_LT((o.best().x - truth).head<3>().norm(), 2.0);
  EXPECT_NEAR(o.best().x[kSize + 2], std::log(1.5), 0.1);
  EXPECT_GT(placeSigma(o.best(), Matrix6d::Zero()), 0.5) << "the place is as of one look";

  // Of what was of no known class the box says what it is.
  o.hypotheses.clear();
  ASSERT_TRUE(reinitialise(o, {{kOtherClass, 1.0}}, e, std::nullopt, frame));
  EXPECT_GT(classProbability(o, "van"), classProbability(o, "car"));
}

TEST_F(Tending, WhatIsClaimedAtRestIsNotBentOutOfShapeByOneBox) {
  frame.view.T_WB = RigidTransform(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0, 0, 1.2));
  const Eigen::Vector3d size = priors.of("car").log_size;
  const Eigen::Vector3d sigma = priors.of("car").log_size_covariance.diagonal().cwiseSqrt();
  State x = makeState(14.0, 1.0, 0.75, 1.2, 4.2, 1.75, 1.5);
  x.segment<3>(kSize) << size[0] - 3.5 * sigma[0], size.tail<2>();
  Track car = makeObject(3, "car", x, 0.05);
  car.existence = {0.99, ExistenceEvidence::kPrior, car.as_of};
  car.life.hits = 30;
  car.life.first_seen = car.life.last_seen = car.as_of = testing::stampOf(0).time;
  State shown = x;  // what passes before it hides an end of it, and is on no map
  shown[kSize] -= 0.3;
  const auto s = projectCuboid(shown, frame.view)->sides;
  Detection d;
  d.box = {s[0], s[1], s[2], s[3]};
  d.activations = {0, 4, -2, -2, -2};

  const auto after = [&](bool claimed) {
    Belief belief{{car}, {}};
    belief.tracks[0].life.confirmed = belief.tracks[0].life.once_confirmed = claimed;
    FrameInput input;
    input.stamp = testing::stampOf(1);
    input.view = frame.view;
    input.model = model;
    input.boxes = {{*makeBoxDetection(d, model, camera.width(), camera.height(), parameters.box,
                                      parameters.clutter)}};
    IdBook ids;
    ids.atLeast(10);
    const Belief before = belief;
    SemanticFilter(parameters, priors).step(before, belief, input, ids);
    return belief.tracks.at(0);
  };
  const Track guess = after(false);
  ASSERT_EQ(guess.id, 3u);
  EXPECT_GT((guess.best().x - x).head<3>().norm(), 0.5) << "begins again from that box";
  const Track o = after(true);
  ASSERT_EQ(o.id, 3u);
  EXPECT_LT((o.best().x - x).head<3>().norm(), 1e-3);
  EXPECT_LT(o.existence, 0.99);
  EXPECT_EQ(o.life.hits, 30u);
  EXPECT_EQ(o.life.visible_misses, 1u);
}

TEST_F(Tending, WhatMayBeAtTwoPlacesIsNotClaimedAtEither) {
  // A large thing far off, or a small one near by: each of them well placed.
  const auto claimed = [&](double far_off, double weight) {
    Track o = makeObject(1, "car", makeState(30, 0, 0.7, 0, 4, 1.8, 1.5), 0.04);
    o.existence = {0.97, ExistenceEvidence::kPrior, o.as_of};
    o.hypotheses.push_back(
        makeObject(1, kOtherClass, makeState(30 - far_off, 0, 1.0, 0, 2, 0.9, 0.8), 0.04).best());
    o.hypotheses[0].weight = 1.0 - weight;
    o.hypotheses[1].weight = weight;
    std::vector<Track> objects{o};
    confirmAndDelete(objects, frame);
    return objects.at(0).life.confirmed;
  };
  EXPECT_TRUE(claimed(0.5, 0.4));
  EXPECT_FALSE(claimed(15.0, 0.4));
  EXPECT_TRUE(claimed(15.0, 0.001)) << "that it is near is ruled out";
}

TEST_F(Tending, WhatWasFoundOnAnotherVisitIsSurerThanWhatWasSeenOnce) {
  Track o = makeObject(1, "car", makeState(10, 0, 0.7, 0, 4, 1.8, 1.5), 0.004);
  EXPECT_EQ(existenceCeiling(o, parameters.tracks), parameters.tracks.certain);
  o.life.detected_on_revisit = true;
  EXPECT_EQ(existenceCeiling(o, parameters.tracks), parameters.tracks.certain_again);
  EXPECT_GT(parameters.tracks.certain_again, parameters.tracks.certain);
}

TEST_F(Tending, LandmarksNearTheCentreGiveTheDepthDespiteABackground) {
  BoxDetection e;
  e.z.sides << 100, 100, 200, 200;
  std::vector<LandmarkDepth> points;
  for (int i = 0; i < 30; ++i) {
    points.push_back({{140.0 + i % 6 * 4.0, 140.0 + i / 6 * 4.0}, 10.0, 0.2});
  }
  for (int i = 0; i < 12; ++i) points.push_back({{104.0, 104.0 + 8.0 * i}, 40.0, 0.2});
  const auto hint = rangeFromLandmarks(e, points, parameters.initiation);
  ASSERT_TRUE(hint);
  EXPECT_NEAR(hint->distance_m, 10.0, 0.6);
  points.resize(3);
  EXPECT_FALSE(rangeFromLandmarks(e, points, parameters.initiation));
}

TEST_F(Tending, WhatWasSeenOnceAndIsOutOfSightIsForgottenAndWhatWasConfirmedIsKept) {
  const auto hiddenFor = [&](double seconds, std::uint32_t hits, bool confirmed) {
    Track o = makeObject(1, "car", makeState(10, 0, 0.7, 0, 4, 1.8, 1.5), 0.04);
    o.life.hits = hits;
    o.life.confirmed = o.life.once_confirmed = confirmed;
    o.visibility.fraction = 0.0;
    o.unused.occluded.count = 5;
    o.unused.occluded.last = o.life.last_seen + Duration(static_cast<std::int64_t>(1e9 * seconds));
    std::vector<Track> objects{o};
    confirmAndDelete(objects, frame);
    return objects.size();
  };
  const double patience = parameters.tracks.tentative_s;
  EXPECT_EQ(hiddenFor(patience + 1.0, 1, false), 0u);
  EXPECT_EQ(hiddenFor(patience - 1.0, 1, false), 1u);
  EXPECT_EQ(hiddenFor(patience + 1.0, 30, false), 1u) << "much is known of it";
  EXPECT_EQ(hiddenFor(patience + 1.0, 3, true), 1u);
}

/// It begins from one yaw, and boxes of anything close at it.
TEST(Published, TheYawOfWhatIsOfNoKnownClassIsUnknownUntilItsModesWereSought) {
  const auto sigmaYaw = [](const char* name, bool sought) {
    Track object = makeObject(1, name, makeState(10, 0, 0.7, 0.3, 1, 1, 1), 0.004);
    object.hypotheses[0].modes_searched = sought;
    return std::sqrt(toBelief(object, 0.7).best().covariance(kYaw, kYaw));
  };
  const double any = M_PI / std::sqrt(12.0);
  EXPECT_NEAR(sigmaYaw("other", false), any, 1e-9);
  EXPECT_LT(sigmaYaw("other", true), 0.5 * any);
  EXPECT_LT(sigmaYaw("car", false), 0.5 * any);
}

TEST(Published, ACovarianceThatRoundingMadeIndefiniteIsMendedAndOthersAreLeftAlone) {
  Track object = makeObject(1, "car", makeState(1, 2, 3, 0.1, 4, 1.8, 1.5), 0.04);
  Matrix7d P = object.hypotheses[0].P.topLeftCorner<7, 7>();
  EXPECT_EQ(toBelief(object, 0.7).best().covariance, P) << "to the bit";
  // Length and width are one number but for rounding, far finer than the place.
  P.block<2, 2>(kSize, kSize).setConstant(1e-8);
  P(kSize + 1, kSize + 1) -= 1e-18;
  P(0, 0) = 1e4;
  object.hypotheses[0].P.topLeftCorner<7, 7>() = P;
  Eigen::LLT<Matrix7d> before(P);
  ASSERT_EQ(before.info(), Eigen::NumericalIssue);
  const Matrix7d mended = toBelief(object, 0.7).best().covariance;
  EXPECT_EQ(Eigen::LLT<Matrix7d>(mended).info(), Eigen::Success);
  EXPECT_EQ(mended, mended.transpose());
  const Vector7d sigma = P.diagonal().cwiseSqrt();
  const Matrix7d scaled = (mended - P).cwiseQuotient(sigma * sigma.transpose());
  EXPECT_LT(scaled.cwiseAbs().maxCoeff(), 1e-6);
}

}  // namespace
}  // namespace perdure::semantic_filter
