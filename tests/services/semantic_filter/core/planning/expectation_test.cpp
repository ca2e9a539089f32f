// Compares the expected fall of entropy with the mean over drawn worlds, and checks what raises and
// lowers it.
#include "services/semantic_filter/core/planning/expectation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <random>

#include "services/semantic_filter/core/association/score.h"
#include "services/semantic_filter/core/planning/entropy.h"
#include "services/semantic_filter/core/planning/places.h"
#include "services/semantic_filter/core/update/ekf.h"
#include "services/semantic_filter/core/update/predict.h"
#include "services/semantic_filter/core/visibility/detectability.h"
#include "tests/services/semantic_filter/scene.h"

namespace perdure::semantic_filter {
namespace {

using testing::makeObject;
using testing::makeState;
using testing::UsualFrame;

constexpr int kWorlds = 200'000;

/// Counts of a hidden value and an observation; their conditional entropy needs no model.
class Counts {
 public:
  void add(int hidden, int observed) { ++count_[observed][hidden], ++hidden_[hidden], ++all_; }
  /// Returns H(hidden) - H(hidden | observed), bits.
  double information() const {
    double bits = entropy(hidden_, all_);
    for (const auto& [observed, given] : count_) {
      double n = 0.0;
      for (const auto& [hidden, k] : given) n += k;
      bits -= n / all_ * entropy(given, n);
    }
    return bits;
  }

 private:
  using Histogram = std::map<int, double>;
  static double entropy(const Histogram& counts, double n) {
    double bits = 0.0;
    for (const auto& [value, k] : counts) bits -= k / n * std::log2(k / n);
    return bits;
  }
  std::map<int, Histogram> count_;
  Histogram hidden_;
  double all_ = 0.0;
};

class Look : public ::testing::Test {
 protected:
  static TimedView from(double x, double y, double yaw, double seconds = 0.0) {
    return {{Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ())),
             Eigen::Vector3d(x, y, 1.2)},
            fromNanoseconds(static_cast<std::int64_t>(seconds * 1e9))};
  }
  static Candidate car(ObjectId id, double x, double y, double existence = 0.9) {
    Candidate candidate{makeObject(id, "car", makeState(x, y, 0.75, 0.3, 4.2, 1.75, 1.5), 0.04),
                        0.0};
    candidate.track.existence = {existence, ExistenceEvidence::kPrior, {}};
    return candidate;
  }
  Fall fallOf(const std::vector<Candidate>& candidates, const std::vector<TimedView>& views) const {
    Fall fall;
    for (const Expectation& e : expect(candidates, views, observer)) fall += e.fall;
    return fall;
  }
  /// P_D of a fully visible car that nothing hides and that is not hard to detect.
  double detectionProbabilityOf(const Candidate& candidate, const TimedView& view) const {
    FrameContext frame;
    frame.view = {observer.camera, view.T_WB, Eigen::Vector3d::UnitZ()};
    frame.parameters = observer.parameters;
    const auto box = projectCuboid(candidate.track.best().x, frame.view);
    const Eigen::Vector4d& s = box->sides;
    return detectionProbability(observer.priors->of("car"),
                                std::sqrt((s[2] - s[0]) * (s[3] - s[1])), frame);
  }

  UsualFrame usual;
  Observer observer{&usual.camera, &usual.priors, &usual.parameters, 2.0};
  std::mt19937 random{5};
};

TEST(Entropy, TheFallOfExistenceIsThatOfDrawnWorlds) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform;
  for (const auto& [r, missed] : {std::pair{0.7, 0.2}, {0.99, 0.5}, {0.05, 0.1}, {0.5, 0.9}}) {
    Counts counts;
    for (int i = 0; i < kWorlds; ++i) {
      const bool exists = uniform(random) < r;
      counts.add(exists, exists && uniform(random) >= missed);
    }
    EXPECT_NEAR(existenceFall(r, missed), counts.information(), 0.004) << r << " " << missed;
  }
  EXPECT_EQ(existenceFall(0.5, 1.0), 0.0);
  EXPECT_EQ(existenceFall(1.0, 0.0), 0.0);
}

TEST(Entropy, TheFallOfTheClassIsThatOfTheSignOfADrawnLogLikelihoodRatio) {
  std::mt19937 random(4);
  std::normal_distribution<double> normal;
  for (const double nats : {0.1, 1.0, 4.0}) {
    Counts counts;
    for (int i = 0; i < kWorlds; ++i) {
      const int which = i % 2;
      const double mean = which == 0 ? nats : -nats;
      counts.add(which, mean + std::sqrt(2.0 * nats) * normal(random) > 0.0);
    }
    EXPECT_NEAR(classFall({0.5, 0.5}, nats), counts.information(), 0.004) << nats;
  }
}

TEST(Entropy, TheFallOfManyClassesIsThatOfDrawnReports) {
  const std::vector<double> pmf{0.6, 0.25, 0.1, 0.05};
  constexpr double kNats = 1.5;
  std::mt19937 random(6);
  std::discrete_distribution<int> any(pmf.begin(), pmf.end());
  std::bernoulli_distribution resolved(std::erf(0.5 * std::sqrt(kNats)));
  Counts counts;
  for (int i = 0; i < kWorlds; ++i) {
    const int which = any(random);
    counts.add(which, resolved(random) ? which : any(random));
  }
  EXPECT_NEAR(classFall(pmf, kNats), counts.information(), 0.004);
  EXPECT_EQ(classFall(pmf, 0.0), 0.0);
}

/// In each world one cause of misses is drawn: an unmapped occluder, a view with few detections, or
/// none. It is the same for views from one place.
TEST_F(Look, TheFallOfExistenceIsThatOfDrawnCausesOfMisses) {
  const Candidate candidate = car(1, 15.0, 1.0, 0.8);
  const VisibilityParameters& v = usual.parameters.visibility;
  const double found = detectionProbabilityOf(candidate, from(0, 0, 0));
  ASSERT_GT(found, 0.5);
  std::uniform_real_distribution<double> uniform;
  for (const std::size_t views : {1, 4}) {
    Counts counts;
    for (int i = 0; i < kWorlds; ++i) {
      const bool exists = uniform(random) < 0.8;
      const double cause = uniform(random);
      double p = found;
      if (cause < v.unmapped_occluder)
        p = 0.0;
      else if (cause < v.unmapped_occluder + v.hard_to_detect)
        p *= v.hard_detection_share;
      int detected = 0;
      for (std::size_t k = 0; k < views; ++k) detected += exists && uniform(random) < p ? 1 : 0;
      counts.add(exists, detected);
    }
    EXPECT_NEAR(fallOf({candidate}, std::vector(views, from(0, 0, 0))).existence,
                counts.information(), 0.005)
        << views;
  }
}

TEST_F(Look, TheFallOfThePositionIsThatOfDrawnObjectsAndBoxes) {
  const Candidate candidate = car(1, 15.0, 1.0);
  const Expectation expected = expect({candidate}, {from(0, 0, 0)}, observer).front();
  FrameContext frame;
  frame.view = {observer.camera, from(0, 0, 0).T_WB, Eigen::Vector3d::UnitZ()};
  frame.priors = observer.priors;
  frame.parameters = observer.parameters;
  Track predicted = candidate.track;
  predict(predicted, {}, {}, frame.parameters->motion, viewWalkOf(frame));
  const Hypothesis& prior = predicted.best();
  const auto entropy = [](const Hypothesis& h) {
    return 0.5 * std::log2(h.P.topLeftCorner<3, 3>().determinant());
  };
  std::normal_distribution<double> normal;
  constexpr int kBoxes = 2000;
  double fall = 0.0;
  for (int i = 0; i < kBoxes; ++i) {
    State x = prior.x;
    for (int k = 0; k < kVelocity; ++k) x[k] += std::sqrt(prior.P(k, k)) * normal(random);
    const auto box = projectObserved(x, frame.view, BoxStyle());
    BoxMeasurement z = measure({box->sides[0], box->sides[1], box->sides[2], box->sides[3]}, 1242.0,
                               375.0, frame.parameters->box);
    for (int k = 0; k < 4; ++k) z.sides[k] += std::sqrt(z.variance[k]) * normal(random);
    fall += (entropy(prior) - entropy(updateWithBox(prior, z, {}, 1.0, frame))) / kBoxes;
  }
  ASSERT_GT(fall, 0.5);
  EXPECT_NEAR(expected.fall.position / (expected.existence * expected.detected), fall, 0.1 * fall);
}

TEST_F(Look, ASecondLookAddsLessThanTheFirstAndMoreFromAnotherPlace) {
  const std::vector<Candidate> one{car(1, 15.0, 1.0)};
  const TimedView here = from(0, 0, 0), again = here, side = from(15, -12, M_PI / 2);
  const double first = fallOf(one, {here}).total(), other = fallOf(one, {side}).total();
  const double twice = fallOf(one, {here, again}).total(), both = fallOf(one, {here, side}).total();
  EXPECT_GT(twice, first);
  EXPECT_LT(twice - first, 0.7 * first);
  EXPECT_GT(both, twice);
  EXPECT_LT(both, first + other + 1e-9);
}

TEST_F(Look, AnObjectSeenLongAgoIsWorthMoreThanOneJustSeen) {
  const std::vector<Candidate> one{car(1, 15.0, 1.0, 0.99)};
  const auto after = [&](double seconds) {
    return fallOf(one, {from(0, 0, 0, seconds)}).existence;
  };
  EXPECT_GT(after(1200), 2.0 * after(1));
  EXPECT_GT(after(2400), after(1200));
  const Expectation old = expect(one, {from(0, 0, 0, 3600)}, observer).front();
  EXPECT_NEAR(old.existence, 0.99 * std::exp(-1.0), 1e-9);
}

TEST_F(Look, AnObjectThatWasSeenFromThisSideIsDetectedMoreProbably) {
  Candidate known = car(1, 15.0, 1.0);
  const double unknown = expect({known}, {from(0, 0, 0)}, observer).front().detected;
  addDirection(known.track.detectability.seen_from, std::atan2(1.0, 15.0), 20.0);
  const double seen = expect({known}, {from(0, 0, 0)}, observer).front().detected;
  EXPECT_LT(unknown, 0.3);
  EXPECT_GT(seen, 0.8);
}

TEST_F(Look, AnObjectBehindAnotherOrOutOfViewHasNoExpectation) {
  const std::vector<Candidate> line{car(1, 10.0, 0.0, 0.99), car(2, 17.0, 0.0), car(3, -9.0, 0.0)};
  const auto expected = expect(line, {from(0, 0, 0)}, observer);
  ASSERT_EQ(expected.size(), 1u);
  EXPECT_EQ(expected.front().candidate, 0u);
}

/// A street along x with a car every 8 m on one side, as the body saw it once.
class Places : public Look {
 protected:
  Places() {
    for (int k = 0; k < 12; ++k) {
      known.push_back(car(1 + k, 8.0 * k, 4.0, 0.99));
      known.back().track.detectability.seen_from.setConstant(20.0F);
      past.push_back(from(8.0 * k - 10.0, 0.0, 0.0, 1.0 * k));
    }
  }
  double unseenFrom(const TimedView& view) const {
    std::vector<Candidate> candidates = known;
    addPlaces(candidates, past, {view}, observer);
    return fallOf(candidates, {view}).unseen;
  }
  std::vector<Candidate> known;
  std::vector<TimedView> past;
};

TEST_F(Places, ASideNeverSeenIsWorthMoreThanAStreetJustSeen) {
  const double just_seen = unseenFrom(from(30, 0, 0, 15));
  EXPECT_GT(just_seen, 0.0);
  EXPECT_GT(unseenFrom(from(30, 0, -M_PI / 2, 15)), 2.0 * just_seen);
}

TEST_F(Places, AStreetSeenLongAgoMayHaveNewObjects) {
  EXPECT_GT(unseenFrom(from(30, 0, 0, 1800)), 2.0 * unseenFrom(from(30, 0, 0, 15)));
}

TEST_F(Places, ArrivalsAndDeparturesKeepTheDensity) {
  std::vector<Candidate> candidates = known;
  const TimedView later = from(30, 0, 0, 36'000);
  addPlaces(candidates, past, {later}, observer);
  std::size_t places = 0;
  const auto expected = expect(candidates, {later}, observer);
  for (const Expectation& e : expected) {
    const double stationary = candidates[e.candidate].stationary;
    if (stationary <= 0.0) continue;
    ++places;
    EXPECT_NEAR(e.existence, stationary, 1e-3);
  }
  EXPECT_GT(places, 20u);
}

TEST_F(Places, WithoutAPastViewNothingIsKnownOfTheDensity) {
  std::vector<Candidate> candidates = known;
  addPlaces(candidates, {}, past, observer);
  EXPECT_EQ(candidates.size(), known.size());
}

TEST(ClassEvidence, PerHitIsTheMarginOfTheLedgers) {
  ObjectBelief belief;
  belief.classes.resize(2);
  belief.classes[0].name = "car", belief.classes[1].name = "van";
  const auto activation = [](double nats) {
    std::vector<double> all(kClassEvidences, 9.0);
    all[static_cast<std::size_t>(ClassEvidence::kActivation)] = nats;
    return all;
  };
  belief.why.classes = {{"car", activation(0.5)}, {"van", activation(-5.5)}};
  belief.why.existence.resize(kExistenceEvidences);
  belief.why.existence[static_cast<std::size_t>(ExistenceEvidence::kHit)].count = 4;
  EXPECT_NEAR(natsPerHit({belief}), 1.5, 1e-12);
  ObjectBelief alone = belief;
  alone.classes.pop_back();
  EXPECT_EQ(natsPerHit({alone}), 0.0);
  alone.why.ousted = {{"van", "car", {}, activation(2.0)}};
  EXPECT_NEAR(natsPerHit({belief, alone}), 1.0, 1e-12);
}

}  // namespace
}  // namespace perdure::semantic_filter
