// Single bookings: who is credited with what.

#include "services/semantic_filter/core/belief/ledger.h"

#include <gtest/gtest.h>

#include <cmath>

#include "services/semantic_filter/core/belief/mixture_ops.h"
#include "services/semantic_filter/core/belief/track_message.h"
#include "services/semantic_filter/core/update/track_update.h"
#include "tests/services/semantic_filter/scene.h"

namespace perdure::semantic_filter {
namespace {

using testing::makeCamera;
using testing::makeModelInfo;
using testing::makePriors;
using testing::makeState;

double sumOf(const std::vector<double>& nats) {
  double sum = 0.0;
  for (const double each : nats) sum += each;
  return sum;
}

double natsOf(const ClassAccount& account, const std::string& name, ClassEvidence kind) {
  for (const auto& c : account.published()) {
    if (c.name == name) return c.log_odds[static_cast<std::size_t>(kind)];
  }
  ADD_FAILURE() << "no class " << name;
  return NAN;
}

TEST(ExistenceLedger, SumsToTheLogOddsOverAMillionChanges) {
  Existence r(0.2, ExistenceEvidence::kPrior, {});
  std::mt19937 random(3);
  std::uniform_real_distribution<double> any(0.001, 0.999);
  for (int i = 0; i < 1'000'000; ++i) {
    const double next = any(random);
    r.become(next, next > r ? ExistenceEvidence::kHit : ExistenceEvidence::kMiss, {});
    r.shift(ExistenceEvidence::kMiss, ExistenceEvidence::kScreened, 0.1 * next, {});
  }
  double sum = 0.0;
  for (const auto& entry : r.published()) sum += entry.log_odds;
  EXPECT_NEAR(sum, std::log(r / (1.0 - r)), 1e-6);
  EXPECT_EQ(r.of(ExistenceEvidence::kHit).count + r.of(ExistenceEvidence::kMiss).count, 1'000'000U);
  EXPECT_GT(r.of(ExistenceEvidence::kHit).log_odds, 1e5);
}

TEST(ExistenceLedger, RemembersTheFirstAndTheLastTimeOfEachKind) {
  Existence r(0.2, ExistenceEvidence::kPrior, fromNanoseconds(5));
  for (const int t : {10, 20, 30}) r.become(0.5, ExistenceEvidence::kHit, fromNanoseconds(t));
  r.note(ExistenceEvidence::kHidden, {0.0, 3, fromNanoseconds(31), fromNanoseconds(33)});
  r.note(ExistenceEvidence::kHidden, {0.0, 2, fromNanoseconds(40), fromNanoseconds(41)});
  r.note(ExistenceEvidence::kHidden, {});
  const LedgerEntry hit = r.of(ExistenceEvidence::kHit), hidden = r.of(ExistenceEvidence::kHidden);
  EXPECT_EQ(hit.count, 3U);
  EXPECT_EQ(hit.first, fromNanoseconds(10));
  EXPECT_EQ(hit.last, fromNanoseconds(30));
  EXPECT_EQ(hidden, (LedgerEntry{0.0, 5, fromNanoseconds(31), fromNanoseconds(41)}));
}

TEST(ExistenceLedger, StaysFiniteWhereExistenceIsZeroOrOne) {
  Existence r(0.5, ExistenceEvidence::kPrior, {});
  r.become(0.0, ExistenceEvidence::kLost, {});
  EXPECT_LT(r.of(ExistenceEvidence::kLost).log_odds, -30.0);
  r.become(1.0, ExistenceEvidence::kHit, {});
  for (const auto& entry : r.published()) EXPECT_TRUE(std::isfinite(entry.log_odds));
}

TEST(ClassLedger, KeepsTheRivalThatCameClosest) {
  ClassAccount account;
  account.book({{"car", 0.5}, {"van", 0.3}, {"bus", 0.2}}, ClassEvidence::kPrior, {});
  account.book({{"car", 0.8}, {"van", 0.15}, {"bus", 0.05}}, ClassEvidence::kActivation, {});
  account.book({{"car", 0.84}, {"van", 0.16}}, ClassEvidence::kPruning, fromNanoseconds(1));
  EXPECT_EQ(account.ousted().at(0).name, "bus");
  account.book({{"car", 0.6}, {"van", 0.4}}, ClassEvidence::kGeometry, {});
  account.book({{"car", 1.0}}, ClassEvidence::kPruning, fromNanoseconds(7));
  const auto ousted = account.ousted();
  ASSERT_EQ(ousted.size(), 1U);
  EXPECT_EQ(ousted[0].name, "van");
  EXPECT_EQ(ousted[0].by, "car");
  EXPECT_EQ(ousted[0].at, fromNanoseconds(7));
  EXPECT_NEAR(sumOf(ousted[0].log_odds), std::log(0.6 / 0.4), 1e-12);
  EXPECT_NEAR(ousted[0].log_odds[0], std::log(0.5 / 0.3), 1e-12);
  ASSERT_EQ(account.published().size(), 1U);
  EXPECT_NEAR(sumOf(account.published()[0].log_odds), 0.0, 1e-12);
}

TEST(ClassLedger, WhatIsGivenBackIsWhatWasPublished) {
  ClassAccount account;
  account.book({{"car", 0.9}, {"van", 0.1}}, ClassEvidence::kPrior, {});
  account.book({{"car", 1.0}}, ClassEvidence::kPruning, {});
  const ClassAccount again(account.published(), account.ousted());
  EXPECT_EQ(again.published(), account.published());
  EXPECT_EQ(again.ousted(), account.ousted());
}

class Booking : public ::testing::Test {
 protected:
  Booking() {
    frame.view.camera = &camera;
    frame.view.T_WB = RigidTransform(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0, 0, 1.2));
    frame.model = &model;
    frame.priors = &priors;
    frame.parameters = &parameters;
    object.id = 1;
    object.existence = {0.6, ExistenceEvidence::kPrior, object.as_of};
    object.hypotheses = {hypothesis("car", 0.7), hypothesis("van", 0.3)};
    object.hypotheses[1].x[6] = std::log(1.7);
    normalise(object, ClassEvidence::kPrior);
  }
  static Hypothesis hypothesis(const std::string& name, double weight) {
    Hypothesis h;
    h.class_name = name;
    h.weight = weight;
    h.x = makeState(15.0, 2.0, 0.75, 0.5, 4.2, 1.75, 1.5);
    h.P.setZero();
    h.P.diagonal().head<7>() << 0.3, 0.3, 0.02, 0.03, 0.01, 0.01, 0.01;
    return h;
  }
  std::vector<BoxDetection> boxOfTheCar(const std::vector<float>& activations = {0, 1.5, -2, -1,
                                                                                 0.5}) const {
    const auto s = projectCuboid(object.hypotheses[0].x, frame.view)->sides;
    Detection d;
    d.box = {s[0], s[1], s[2], s[3]};
    d.activations = activations;
    return {*makeBoxDetection(d, model, camera.width(), camera.height(), parameters.box,
                              parameters.clutter)};
  }
  void computeVisibility(const std::vector<BoxDetection>& boxes, double eta = 1.0) {
    TrackVisibility visibility;
    visibility.fraction = 1.0;
    const auto n = static_cast<Eigen::Index>(boxes.size());
    update(object, scoreTrack(object, visibility, boxes, frame), Eigen::VectorXd::Constant(n, eta),
           boxes, frame);
  }

  CameraModel camera{makeCamera()};
  Model model = makeModel(makeModelInfo());
  ClassPriors priors = makePriors();
  Parameters parameters;
  FrameContext frame;
  Track object;
};

TEST_F(Booking, AHitDividesIntoWhatTheNetworkSaidAndWhatTheGeometryDid) {
  computeVisibility(boxOfTheCar());
  const auto of = [&](ClassEvidence kind) {
    return natsOf(object.classes, "car", kind) - natsOf(object.classes, "van", kind);
  };
  EXPECT_NEAR(of(ClassEvidence::kPrior), std::log(0.7 / 0.3), 1e-9);
  EXPECT_NEAR(of(ClassEvidence::kActivation), 1.5 - 0.5, 1e-3);  // a first look counts in full
  EXPECT_GT(of(ClassEvidence::kGeometry), 0.5);  // the box is the car's, and the van is higher
  EXPECT_EQ(of(ClassEvidence::kMiss), 0.0);
  EXPECT_EQ(object.existence.of(ExistenceEvidence::kHit).count, 1U);
  EXPECT_NEAR(object.existence.of(ExistenceEvidence::kHit).log_odds,
              logOdds(object.existence) - logOdds(0.6), 1e-12);
}

TEST_F(Booking, WhatTheNetworkSaidIsWhatWouldBeMissingHadItSaidNothing) {
  // The box is shared with another object, so that the look is not surely a hit.
  parameters.box.sigma_weak = 0.0;  // or the activations change the box's noise, too
  Track silent = object;
  const double before = std::log(0.7 / 0.3), eta = 2e-6;
  computeVisibility(boxOfTheCar(), eta);
  std::swap(silent, object);
  computeVisibility(boxOfTheCar({0, 0, 0, 0, 0}), eta);
  std::swap(silent, object);
  ASSERT_EQ(object.existence.of(ExistenceEvidence::kHit).count, 1U);
  const auto odds = [](const Track& o) {
    return std::log(classProbability(o, "car") / classProbability(o, "van"));
  };
  const double said = natsOf(object.classes, "car", ClassEvidence::kActivation) -
                      natsOf(object.classes, "van", ClassEvidence::kActivation);
  EXPECT_NEAR(said, odds(object) - odds(silent), 1e-9);
  EXPECT_GT(said, 0.1);
  EXPECT_GT(std::abs(said - 1.0), 0.02);  // 1.0 is said of a box that is surely its own
  EXPECT_GT(odds(silent), before);
}

TEST_F(Booking, TheSameLookAgainIsSaidToBeARepetition) {
  for (int k = 0; k < 10; ++k) computeVisibility(boxOfTheCar());
  EXPECT_EQ(object.life.hits, 10U);
  EXPECT_GE(object.existence.of(ExistenceEvidence::kRepeated).count, 5U);
  EXPECT_EQ(object.existence.of(ExistenceEvidence::kHit).count +
                object.existence.of(ExistenceEvidence::kRepeated).count,
            10U);
}

TEST_F(Booking, AScreenExcusesPartOfAMiss) {
  Track open = object;
  computeVisibility({});
  const double miss = object.existence.of(ExistenceEvidence::kMiss).log_odds;
  EXPECT_LT(miss, -1.0);
  EXPECT_EQ(object.existence.of(ExistenceEvidence::kScreened).count, 0U);
  std::swap(open, object);
  object.detectability.unmapped_occluder = 0.5;
  computeVisibility({});
  EXPECT_NEAR(object.existence.of(ExistenceEvidence::kMiss).log_odds, miss, 1e-9);
  EXPECT_GT(object.existence.of(ExistenceEvidence::kScreened).log_odds, 0.5);
  EXPECT_NEAR(object.existence.of(ExistenceEvidence::kScreened).log_odds + miss,
              logOdds(object.existence) - logOdds(0.6), 1e-9);
}

TEST_F(Booking, WhatCameBackWithoutALedgerIsBookedAsThat) {
  computeVisibility(boxOfTheCar());
  ObjectBelief belief = toBelief(object, 0.7);
  const Track with = fromBelief(belief, Matrix6d::Identity(), ExistenceEvidence::kRestore);
  EXPECT_NEAR(with.existence.of(ExistenceEvidence::kRestore).log_odds, 0.0, 1e-12);
  EXPECT_EQ(with.existence.of(ExistenceEvidence::kRestore).count, 1U);
  EXPECT_EQ(with.existence.of(ExistenceEvidence::kHit),
            object.existence.of(ExistenceEvidence::kHit));
  belief.why = {};
  const Track without = fromBelief(belief, Matrix6d::Identity(), ExistenceEvidence::kRecall);
  EXPECT_NEAR(without.existence.of(ExistenceEvidence::kRecall).log_odds, logOdds(belief.existence),
              1e-12);
  EXPECT_NEAR(natsOf(without.classes, "car", ClassEvidence::kRestore),
              std::log(belief.best().probability), 1e-12);
}

}  // namespace
}  // namespace perdure::semantic_filter
