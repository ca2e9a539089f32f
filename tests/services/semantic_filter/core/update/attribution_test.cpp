#include "services/semantic_filter/core/update/attribution.h"

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

double natsOf(const ClassAccount& account, const std::string& name, ClassEvidence kind) {
  Ledger ledger;
  account.publish(ledger);
  for (const auto& c : ledger.classes) {
    if (c.name == name) return c.log_odds[static_cast<std::size_t>(kind)];
  }
  ADD_FAILURE() << "no class " << name;
  return NAN;
}

class Attribution : public ::testing::Test {
 protected:
  Attribution() {
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

TEST_F(Attribution, AHitDividesIntoActivationAndGeometry) {
  computeVisibility(boxOfTheCar());
  const auto of = [&](ClassEvidence kind) {
    return natsOf(object.classes, "car", kind) - natsOf(object.classes, "van", kind);
  };
  EXPECT_NEAR(of(ClassEvidence::kPrior), std::log(0.7 / 0.3), 1e-9);
  // the first observation counts in full
  EXPECT_NEAR(of(ClassEvidence::kActivation), 1.5 - 0.5, 1e-3);
  EXPECT_GT(of(ClassEvidence::kGeometry), 0.5);  // the box fits the car; the van is higher
  EXPECT_EQ(of(ClassEvidence::kMiss), 0.0);
  EXPECT_EQ(object.existence.of(ExistenceEvidence::kHit).count, 1U);
  EXPECT_NEAR(object.existence.of(ExistenceEvidence::kHit).log_odds,
              logOdds(object.existence) - logOdds(0.6), 1e-12);
}

TEST_F(Attribution, TheActivationPartIsWhatEqualActivationsWouldLack) {
  // Another track shares the box, so the observation is not certainly a hit.
  parameters.box.sigma_weak = 0.0;  // otherwise the activations also change the noise of the box
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
  EXPECT_GT(std::abs(said - 1.0), 0.02);  // 1.0 would be the value for an assigned box
  EXPECT_GT(odds(silent), before);
}

TEST_F(Attribution, TheSameObservationAgainIsBookedAsARepetition) {
  for (int k = 0; k < 10; ++k) computeVisibility(boxOfTheCar());
  EXPECT_EQ(object.life.hits, 10U);
  EXPECT_GE(object.existence.of(ExistenceEvidence::kRepeated).count, 5U);
  EXPECT_EQ(object.existence.of(ExistenceEvidence::kHit).count +
                object.existence.of(ExistenceEvidence::kRepeated).count,
            10U);
}

TEST_F(Attribution, AnUnmappedOccluderExcusesPartOfAMiss) {
  Track open = object;
  computeVisibility({});
  const double miss = object.existence.of(ExistenceEvidence::kMiss).log_odds;
  EXPECT_LT(miss, -1.0);
  EXPECT_EQ(object.existence.of(ExistenceEvidence::kUnmappedOccluder).count, 0U);
  std::swap(open, object);
  object.detectability.unmapped_occluder = 0.5;
  computeVisibility({});
  EXPECT_NEAR(object.existence.of(ExistenceEvidence::kMiss).log_odds, miss, 1e-9);
  EXPECT_GT(object.existence.of(ExistenceEvidence::kUnmappedOccluder).log_odds, 0.5);
  EXPECT_NEAR(object.existence.of(ExistenceEvidence::kUnmappedOccluder).log_odds + miss,
              logOdds(object.existence) - logOdds(0.6), 1e-9);
}

TEST_F(Attribution, ARecalledObjectWithoutALedgerIsBookedAsRecalled) {
  computeVisibility(boxOfTheCar());
  ObjectBelief belief = toBelief(object, makePriors(), 0.7);
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
