
#include "services/semantic_filter/core/update/track_update.h"

#include <gtest/gtest.h>

#include <cstring>

#include "services/semantic_filter/core/association/joint_association.h"
#include "services/semantic_filter/core/belief/mixture_ops.h"
#include "services/semantic_filter/core/tracks/lifecycle.h"
#include "services/semantic_filter/core/update/ekf.h"
#include "tests/services/semantic_filter/scene.h"

namespace perdure::semantic_filter {
namespace {

using testing::makeCamera;
using testing::makeModelInfo;
using testing::makePriors;
using testing::makeState;

class TrackUpdate : public ::testing::Test {
 protected:
  TrackUpdate() {
    frame.view.camera = &camera;
    frame.view.T_WB = RigidTransform(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0, 0, 1.2));
    frame.model = &model;
    frame.priors = &priors;
    frame.parameters = &parameters;
    object.id = 1;
    object.existence = {0.6, ExistenceEvidence::kPrior, object.as_of};
    object.hypotheses = {hypothesis("car", 0.7), hypothesis("van", 0.3)};
    object.hypotheses[1].x[6] = std::log(1.7);
  }
  Hypothesis hypothesis(const std::string& name, double weight) const {
    Hypothesis h;
    h.class_name = name;
    h.weight = weight;
    h.x = makeState(15.0, 2.0, 0.75, 0.5, 4.2, 1.75, 1.5);
    h.P.setZero();
    h.P.diagonal().head<7>() << 0.3, 0.3, 0.02, 0.03, 0.01, 0.01, 0.01;
    return h;
  }
  BoxDetection evidenceOf(const State& x, float shift = 0.0F) const {
    const auto s = projectCuboid(x, frame.view)->sides;
    Detection d;
    d.box = {s[0], s[1], s[2], s[3]};
    for (const float a : {0.0F, 1.5F, -2.0F, -1.0F, 0.5F}) d.activations.push_back(a + shift);
    return *makeBoxDetection(d, model, camera.width(), camera.height(), parameters.box,
                             parameters.clutter);
  }
  TrackScore scoreHypothesis(const std::vector<BoxDetection>& boxes, double v) const {
    TrackVisibility visibility;
    visibility.fraction = v;
    visibility.state = v > 0 ? Visibility::kVisible : Visibility::kOccluded;
    return scoreTrack(object, visibility, boxes, frame);
  }

  CameraModel camera{makeCamera()};
  Model model = makeModel(makeModelInfo());
  ClassPriors priors = makePriors();
  Parameters parameters;
  FrameContext frame;
  Track object;
};

bool sameBits(const Track& a, const Track& b) {
  if (a.hypotheses.size() != b.hypotheses.size()) return false;
  const double r_a = a.existence, r_b = b.existence;
  if (std::memcmp(&r_a, &r_b, sizeof(double)) != 0) return false;
  if (std::memcmp(&a.detectability.unmapped_occluder, &b.detectability.unmapped_occluder,
                  sizeof(double)) != 0)
    return false;
  if (std::memcmp(&a.detectability.hard_to_detect, &b.detectability.hard_to_detect,
                  sizeof(double)) != 0)
    return false;
  for (std::size_t i = 0; i < a.hypotheses.size(); ++i) {
    const Hypothesis &x = a.hypotheses[i], &y = b.hypotheses[i];
    if (std::memcmp(&x.weight, &y.weight, sizeof(double)) != 0) return false;
    if (std::memcmp(x.x.data(), y.x.data(), sizeof(double) * kStateDim) != 0) return false;
    if (std::memcmp(x.P.data(), y.P.data(), sizeof(double) * kStateDim * kStateDim) != 0)
      return false;
    if (std::memcmp(x.C.data(), y.C.data(), sizeof(double) * kStateDim * 6) != 0) return false;
  }
  return true;
}

TEST_F(TrackUpdate, AtVisibilityZeroTheBeliefKeepsEveryBit) {
  const std::vector<BoxDetection> boxes = {evidenceOf(object.hypotheses[0].x)};
  const Track before = object;
  update(object, scoreHypothesis(boxes, 0.0), Eigen::VectorXd::Ones(1), boxes, frame);
  EXPECT_TRUE(sameBits(before, object));
  update(object, scoreHypothesis(boxes, 1.0), Eigen::VectorXd::Ones(1), boxes, frame);
  EXPECT_FALSE(sameBits(before, object));
}

TEST_F(TrackUpdate, TwoClassesFollowEquationFourByHand) {
  const std::vector<BoxDetection> boxes = {evidenceOf(object.hypotheses[0].x)};
  const TrackScore l = scoreHypothesis(boxes, 0.8);
  const double eta = 0.4;
  double A[2];
  for (int k = 0; k < 2; ++k) {
    const auto& h = l.hypotheses[k];
    const auto box = projectCuboid(object.hypotheses[k].x, frame.view);
    const double size =
        std::sqrt((box->sides[2] - box->sides[0]) * (box->sides[3] - box->sides[1]));
    const double P_D =
        0.9 /
        (1.0 + std::exp(-(size - parameters.box.min_size_px) / (0.2 * parameters.box.min_size_px)));
    const auto score = scoreBox(boxes[0].z, *box,
                                predictedCovariance(object.hypotheses[k], *box, Matrix6d::Zero()),
                                {}, parameters.box);
    ASSERT_TRUE(score);
    const double g = k == 0 ? 1.5 : 0.5;
    const double L = std::exp(g + score->log_density - boxes[0].log_clutter);
    EXPECT_NEAR(h.matches[0].likelihood / L, 1.0, 1e-9);
    A[k] = 1.0 - 0.8 * P_D + 0.8 * P_D * eta * L;
  }
  const double mean = 0.7 * A[0] + 0.3 * A[1];
  update(object, l, Eigen::VectorXd::Constant(1, eta), boxes, frame);
  EXPECT_NEAR(classProbability(object, "car"), 0.7 * A[0] / mean, 1e-9);
  const double odds = 0.6 / 0.4 * mean;
  EXPECT_NEAR(object.existence, std::min(odds / (1.0 + odds), parameters.tracks.certain), 1e-12);
}

TEST_F(TrackUpdate, AMissLowersExistenceByItsOddsAlone) {
  const TrackScore l = scoreHypothesis({}, 1.0);
  const double P_D[2] = {l.hypotheses[0].detection_probability,
                         l.hypotheses[1].detection_probability};
  const double mean = 0.7 * (1 - P_D[0]) + 0.3 * (1 - P_D[1]);
  const State before = object.best().x;
  update(object, l, Eigen::VectorXd(0), {}, frame);
  EXPECT_NEAR(object.existence, 0.6 * mean / (0.4 + 0.6 * mean), 1e-12);
  EXPECT_EQ(object.best().x, before);
}

TEST_F(TrackUpdate, MissesFromOneViewpointShowAtMostAnUnmappedOccluder) {
  object.existence = {0.99, ExistenceEvidence::kPrior, object.as_of};
  object.detectability.unmapped_occluder = 0.25;
  for (int k = 0; k < 100; ++k)
    update(object, scoreHypothesis({}, 1.0), Eigen::VectorXd(0), {}, frame);
  EXPECT_GT(object.detectability.unmapped_occluder, 0.99);
  const double odds = object.existence / (1.0 - object.existence);
  EXPECT_NEAR(odds, 0.25 * 99.0,
              0.3);  // only the initial unmapped_occluder remains
}

TEST_F(TrackUpdate, ADetectionExcludesAnUnmappedOccluder) {
  object.detectability.unmapped_occluder = 0.25;
  const std::vector<BoxDetection> boxes = {evidenceOf(object.hypotheses[0].x)};
  update(object, scoreHypothesis(boxes, 1.0), Eigen::VectorXd::Ones(1), boxes, frame);
  EXPECT_LT(object.detectability.unmapped_occluder, 0.01);
}

/// Detected in one observation of five: the tenth shows that its detection probability is low.
TEST_F(TrackUpdate, ATrackSeldomDetectedFromHereKeepsItsExistence) {
  const std::vector<BoxDetection> box = {evidenceOf(object.hypotheses[0].x)}, nothing;
  parameters.visibility.hard_detection_share = 0.3;
  Track plain = object, asked = object;
  asked.detectability.hard_to_detect = 0.1;
  asked.existence = plain.existence = {0.99, ExistenceEvidence::kPrior, object.as_of};
  double least = 1.0, least_plain = 1.0;
  for (int i = 0; i < 60; ++i) {
    const auto& boxes = i % 5 == 0 ? box : nothing;
    const Eigen::VectorXd eta = Eigen::VectorXd::Ones(static_cast<Eigen::Index>(boxes.size()));
    std::swap(object, asked);
    update(object, scoreHypothesis(boxes, 1.0), eta, boxes, frame);
    std::swap(object, asked);
    std::swap(object, plain);
    update(object, scoreHypothesis(boxes, 1.0), eta, boxes, frame);
    std::swap(object, plain);
    if (i < 10) continue;
    least = std::min<double>(least, asked.existence);
    least_plain = std::min<double>(least_plain, plain.existence);
  }
  EXPECT_GT(asked.detectability.hard_to_detect, 0.9);
  EXPECT_GT(least, 0.5);
  EXPECT_LT(least_plain, 0.2);
}

/// One box does not prune a mode that explains it almost as well and is weighted by all keyframes.
TEST_F(TrackUpdate, AModeWeighedByAllKeyframesStaysUntilTheNextModeSearch) {
  Hypothesis turned = object.hypotheses[0];  // each observation is ten times less likely under it
  turned.x[kYaw] += 1.0;
  turned.weight = 0.05;
  object.hypotheses = {object.hypotheses[0], turned};
  object.hypotheses[0].weight = 0.95;
  const std::vector<BoxDetection> boxes = {evidenceOf(object.hypotheses[0].x)};
  const auto turnedAfter = [&](bool sought) {
    Track one = object;
    for (auto& h : one.hypotheses) h.modes_searched = sought;
    std::swap(object, one);
    TrackScore l = scoreHypothesis(boxes, 1.0);
    const double A =
        1.0 + l.hypotheses[0].detection_probability * (l.hypotheses[0].matches[0].likelihood - 1.0);
    l.hypotheses[1].matches[0].likelihood = 0.1 * l.hypotheses[0].matches[0].likelihood;
    EXPECT_GT(A, 10.0);
    for (int i = 0; i < 3; ++i) {
      update(object, l, Eigen::VectorXd::Ones(1), boxes, frame);
      normalise(object, ClassEvidence::kGeometry);
    }
    std::swap(object, one);
    double off = 0.0;
    for (const auto& h : one.hypotheses) off += h.x[kYaw] > 1.0 ? h.weight : 0.0;
    return off;
  };
  const double least = parameters.smoothing.least_weight;
  EXPECT_LT(turnedAfter(false), 1e-3);
  EXPECT_NEAR(turnedAfter(true), least, 0.1 * least);
}

TEST_F(TrackUpdate, UsesTheDetectionRateOfThisViewpoint) {
  parameters.visibility.hard_detection_share = 0.3;
  object.hypotheses.resize(1);
  object.hypotheses[0].weight = 1.0;
  object.detectability.unmapped_occluder = 0.2;
  object.detectability.hard_to_detect = 0.1;
  const TrackScore l = scoreHypothesis({}, 1.0);
  const double P_D = l.hypotheses[0].detection_probability / (0.7 + 0.3 * 0.1);
  const double A = 0.2 + 0.1 * (1.0 - 0.3 * P_D) + 0.7 * (1.0 - P_D);
  EXPECT_NEAR(l.hypotheses[0].no_box, A, 1e-12);
  update(object, l, Eigen::VectorXd(0), {}, frame);
  EXPECT_NEAR(object.detectability.unmapped_occluder, 0.2 / A, 1e-12);
  EXPECT_NEAR(object.detectability.hard_to_detect, 0.1 * (1.0 - 0.3 * P_D) / A, 1e-12);
}

TEST_F(TrackUpdate, ABoxAtThePlaceOfAnObjectOfTheMapIsNoMiss) {
  const std::vector<BoxDetection> boxes{evidenceOf(object.best().x)};
  const TrackScore seen = scoreHypothesis(boxes, 1.0);
  for (const bool recalled : {true, false}) {
    Track taken = object;
    taken.life.recalled = recalled;
    update(taken, seen, Eigen::VectorXd::Zero(1), boxes, frame);  // another track has the box
    EXPECT_EQ(sameBits(taken, object), recalled);
  }
  Track missed = object;
  missed.life.recalled = true;
  update(missed, scoreHypothesis({}, 1.0), Eigen::VectorXd(), {}, frame);
  EXPECT_LT(missed.existence, object.existence);
}

TEST_F(TrackUpdate, ADetectionNotesItsDirectionAndDistance) {
  const std::vector<BoxDetection> boxes{evidenceOf(object.best().x)};
  update(object, scoreHypothesis(boxes, 1.0), Eigen::VectorXd::Ones(1), boxes, frame);
  EXPECT_NEAR(object.detectability.seen_now[0], 15.0F, 0.5F);
  EXPECT_EQ(object.detectability.seen_now.count(), 1);
}

TEST_F(TrackUpdate, MissesSayHowSmallIsTooSmallOnceTheObjectIsDetectedAgain) {
  object.life.once_confirmed = true;
  frame.size_scale = 5.0;  // the car is about as small as what is found half of the time
  const std::vector<BoxDetection> boxes{evidenceOf(object.best().x)};
  update(object, scoreHypothesis({}, 1.0), Eigen::VectorXd(), {}, frame);
  EXPECT_EQ(object.detectability.proven.information, 0.0);
  EXPECT_GT(object.detectability.missed.gradient, 0.0);
  update(object, scoreHypothesis(boxes, 1.0), Eigen::VectorXd::Ones(1), boxes, frame);
  EXPECT_GT(object.detectability.proven.gradient, 0.0);
  EXPECT_EQ(object.detectability.missed.information, 0.0);
}

/// One miss in five observations, from a camera at rest.
TEST_F(TrackUpdate, AnObservationWhoseBoxIsRefusedIsAMiss) {
  const std::vector<BoxDetection> boxes{evidenceOf(object.best().x)};
  const TrackScore seen = scoreHypothesis(boxes, 0.9);
  Track hit = object, miss = object;
  update(hit, seen, Eigen::VectorXd::Ones(1), boxes, frame);
  ASSERT_EQ(hit.life.hits, object.life.hits + 1);
  update(miss, scoreHypothesis({}, 0.9), Eigen::VectorXd(), {}, frame);
  const Track refused = updateAsMissed(object, seen, frame);
  EXPECT_EQ(refused.existence, miss.existence);
  EXPECT_LT(refused.existence, object.existence);
  EXPECT_EQ(refused.life.hits, object.life.hits);
  EXPECT_EQ(refused.life.visible_misses, object.life.visible_misses + 1);
  EXPECT_EQ(refused.best().x, object.best().x);
  EXPECT_EQ(refused.best().P, object.best().P);
}

TEST_F(TrackUpdate, ADetectionAfterMissesFromOneViewpointShowsThatTheNetworkMissedIt) {
  const std::vector<BoxDetection> box = {evidenceOf(object.hypotheses[0].x)}, nothing;
  for (int i = 0; i < 100; ++i) {
    const auto& boxes = i % 5 == 4 ? nothing : box;
    update(object, scoreHypothesis(boxes, 1.0), Eigen::VectorXd::Ones(1), boxes, frame);
  }
  EXPECT_GT(object.existence, 0.9);
  EXPECT_GT(classProbability(object, "car"), 0.6);
}

TEST_F(TrackUpdate, MissesFromAViewpointThatDetectedItLowerExistenceAtOnce) {
  const std::vector<BoxDetection> box = {evidenceOf(object.hypotheses[0].x)}, nothing;
  for (int i = 0; i < 30; ++i) {
    update(object, scoreHypothesis(box, 1.0), Eigen::VectorXd::Ones(1), box, frame);
  }
  ASSERT_GT(object.existence, 0.9);
  object.detectability.unmapped_occluder = 0.0;  // nothing can hide it
  for (int i = 0; i < 4; ++i) {
    update(object, scoreHypothesis(nothing, 1.0), Eigen::VectorXd::Ones(0), nothing, frame);
    object.detectability.unmapped_occluder = 0.0;
  }
  EXPECT_LT(object.existence, 0.2);
}

/// The error of a side lasts for some frames; a later box is a new observation.
TEST_F(TrackUpdate, BetweenRestAndMotionABoxCountsByTheTimeSinceTheLastOne) {
  Hypothesis astray = object.hypotheses[0];  // a hypothesis of the same class, away from the box
  astray.moving = true;
  astray.x[1] += 0.8;
  object.hypotheses = {object.hypotheses[0], astray, object.hypotheses[1]};
  object.hypotheses[0].weight = object.hypotheses[1].weight = 0.35;
  const std::vector<BoxDetection> boxes = {evidenceOf(object.hypotheses[0].x)};
  object.views.observed_from = {frame.view.T_WC(), 50.0};  // almost no weight between classes
  const TrackScore l = scoreHypothesis(boxes, 1.0);
  double A[3];
  for (int i = 0; i < 3; ++i) {
    A[i] =
        1.0 - l.hypotheses[i].detection_probability * (1.0 - l.hypotheses[i].matches[0].likelihood);
  }
  const Track before = object;
  for (const auto& [seconds, exponent] : {std::pair{0.1, 0.271}, std::pair{5.0, 1.0}}) {
    object = before;
    object.life.last_seen =
        object.as_of - std::chrono::duration_cast<Duration>(std::chrono::duration<double>(seconds));
    update(object, l, Eigen::VectorXd::Ones(1), boxes, frame);
    double still = 0.0, moving = 0.0;
    for (const auto& h : object.hypotheses) {
      if (h.class_name == "car") (h.moving ? moving : still) = h.weight;
    }
    EXPECT_NEAR(std::log(moving / still) / std::log(A[1] / A[0]), exponent, 1e-3);
    EXPECT_NEAR(classProbability(object, "car"), 0.7, 0.05);
  }
}

TEST_F(TrackUpdate, AConstantAddedToAllActivationsChangesNothing) {
  const std::vector<BoxDetection> plain = {evidenceOf(object.hypotheses[0].x)};
  const std::vector<BoxDetection> shifted = {evidenceOf(object.hypotheses[0].x, 64.0F)};
  const TrackScore a = scoreHypothesis(plain, 1.0), b = scoreHypothesis(shifted, 1.0);
  Track other = object;
  update(object, a, Eigen::VectorXd::Ones(1), plain, frame);
  update(other, b, Eigen::VectorXd::Ones(1), shifted, frame);
  EXPECT_TRUE(sameBits(object, other));
}

TEST_F(TrackUpdate, AzimuthNeverTouchesExistenceClassOrMotion) {
  std::vector<BoxDetection> boxes = {evidenceOf(object.hypotheses[0].x)};
  Hypothesis turned = object.hypotheses[0];
  turned.x[kYaw] += M_PI / 2;
  turned.weight = 0.2;
  object.hypotheses.push_back(turned);
  normalise(object, ClassEvidence::kPrior);
  Track with = object;
  const TrackScore l = scoreHypothesis(boxes, 1.0);
  update(object, l, Eigen::VectorXd::Ones(1), boxes, frame);
  boxes[0].azimuth = 0.3;
  update(with, l, Eigen::VectorXd::Ones(1), boxes, frame);
  EXPECT_EQ(with.existence, object.existence);
  EXPECT_NEAR(classProbability(with, "car"), classProbability(object, "car"), 1e-12);
  EXPECT_NE(with.best().x[kYaw], object.best().x[kYaw]);
}

TEST_F(TrackUpdate, ConfidenceNeverFallsOnConsistentPositives) {
  double last = object.existence;
  for (int k = 0; k < 20; ++k) {
    frame.view.T_WB.p.x() += 0.3;
    const std::vector<BoxDetection> boxes = {
        evidenceOf(makeState(15.0, 2.0, 0.75, 0.5, 4.2, 1.75, 1.5))};
    update(object, scoreHypothesis(boxes, 1.0), Eigen::VectorXd::Ones(1), boxes, frame);
    EXPECT_GE(object.existence, last);
    last = object.existence;
  }
  EXPECT_EQ(last, parameters.tracks.certain);
}

TEST_F(TrackUpdate, ManyObservationsFromOneViewpointAddLittle) {
  const std::vector<BoxDetection> boxes = {evidenceOf(object.hypotheses[0].x)};
  double first = 0.0, last = 0.0;
  for (int k = 0; k < 200; ++k) {
    const double before = object.best().P.trace();
    update(object, scoreHypothesis(boxes, 1.0), Eigen::VectorXd::Ones(1), boxes, frame);
    last = before - object.best().P.trace();
    if (k == 0) first = last;
  }
  EXPECT_LT(last, 1e-3 * first);
}

TEST_F(TrackUpdate, ManyObservationsUnderOnePoseErrorDoNotBeatIt) {
  frame.pose_error.covariance.diagonal() << 1e-8, 1e-8, 1e-8, 0.04, 0.04, 0.04;
  for (auto& h : object.hypotheses) {  // the position contains the pose error, as at initiation
    h.C.topRightCorner<3, 3>() = 0.04 * Eigen::Matrix3d::Identity();
    h.P.diagonal().head<3>().array() += 0.04;
  }
  const BoxDetection box = evidenceOf(object.hypotheses[0].x);
  Hypothesis h = object.hypotheses[0];
  const double before = h.P(1, 1);
  for (int k = 0; k < 100; ++k) h = updateWithBox(h, box.z, {}, 1.0, frame);
  EXPECT_LT(h.P(1, 1), 0.5 * before);  // the observations had an effect
  EXPECT_GT(h.P(1, 1), 0.039);
}

TEST_F(TrackUpdate, AnOutlierMovesTheStateLessThanItsNoiseWouldLetIt) {
  const Hypothesis h = object.hypotheses[0];
  const auto moved = [&](double metres) {
    State far = h.x;
    far[1] += metres;
    return (updateWithBox(h, evidenceOf(far).z, {}, 1.0, frame).x - h.x).head<3>().norm();
  };
  EXPECT_LT(moved(4.0), 3.6 * moved(1.0));
}

TEST_F(TrackUpdate, EkfShrinksTheErrorOfPositionFromASeriesOfViews) {
  const State truth = makeState(15.3, 2.1, 0.7, 0.45, 4.3, 1.7, 1.55);
  Hypothesis h = object.hypotheses[0];
  const double before = (h.x - truth).head<3>().norm();
  for (int k = 0; k < 30; ++k) {
    frame.view.T_WB.p.x() += 0.3;
    h = updateWithBox(h, evidenceOf(truth).z, {}, 1.0, frame);
  }
  EXPECT_LT((h.x - truth).head<3>().norm(), 0.5 * before);
  EXPECT_LT((h.x - truth).head<3>().norm(), 3.0 * std::sqrt(h.P.topLeftCorner<3, 3>().trace()));
}

}  // namespace
}  // namespace perdure::semantic_filter
