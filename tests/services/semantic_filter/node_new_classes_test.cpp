// A swap of the network under existing tracks. Classes are mapped by name, new ones start at their
// prior, and classes that the new network lacks remain.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numeric>

#include "services/semantic_filter/core/belief/mixture_ops.h"
#include "tests/services/semantic_filter/scene.h"

namespace perdure::semantic_filter {
namespace {

using testing::driveTo;
using testing::Harness;
using ::testing::HasSubstr;
using testing::makeState;
using testing::odometryAt;
using testing::TrueObject;

const TrueObject kVan = {makeState(18, 3.5, 1.05, 0.1, 5.0, 1.9, 2.1), "van"};
const TrueObject kChair = {makeState(9, -2.0, 0.45, 0.3, 0.5, 0.5, 0.9), "chair"};

/// A network that names each object's class if it has it, and otherwise a class that the object
/// resembles.
struct Network {
  ModelInfo info;
  /// Reported class for objects of classes that the network does not have.
  std::map<std::string, std::string> says;

  Network(std::uint64_t hash, const std::string& name, std::vector<std::string> classes,
          std::map<std::string, std::string> lookalike_class = {})
      : says(std::move(lookalike_class)) {
    info.hash = hash;
    info.name = name;
    info.classes = std::move(classes);
  }
  Detections look(const std::vector<TrueObject>& things, std::uint64_t k) const {
    static const CameraModel camera{testing::makeCamera()};
    std::mt19937 random(static_cast<std::uint32_t>(k) + 1);
    View view;
    view.camera = &camera;
    view.T_WB = driveTo(k, 0.3);
    std::vector<Detection> list;
    for (const auto& thing : things) {
      auto d = testing::detect(thing, view, BoxParameters{}, 0.5, 3.0, random);
      if (!d) continue;
      const auto other = says.find(thing.class_name);
      const std::string& called = other == says.end() ? thing.class_name : other->second;
      d->activations = {0.0F};
      for (const auto& name : info.classes) d->activations.push_back(name == called ? 3.0F : -3.0F);
      list.push_back(*d);
    }
    Detections message = testing::detectionsAt(k, std::move(list));
    message.model_hash = info.hash;
    return message;
  }
};

void drive(Harness& h, const Network& network, const std::vector<TrueObject>& things,
           std::uint64_t from, std::uint64_t to) {
  h.node.onModel(network.info);
  for (std::uint64_t k = from; k < to; ++k) {
    h.node.onOdometry(odometryAt(k, driveTo(k, 0.3)));
    h.node.onDetections(network.look(things, k));
  }
}

const Track& only(const Harness& h) {
  EXPECT_EQ(h.node.belief().tracks.size(), 1u);
  return h.node.belief().tracks.front();
}

double sumOfWeights(const Track& o) {
  return std::accumulate(o.hypotheses.begin(), o.hypotheses.end(), 0.0,
                         [](double sum, const Hypothesis& h) { return sum + h.weight; });
}

const Network kOld(101, "old", {"car", "chair"}, {{"van", "car"}});
const Network kNew(102, "new", {"van", "chair", "car"});
const Network kCarsOnly(103, "cars", {"car"}, {{"chair", "nothing"}});

TEST(NodeNewClasses, EnterATrackAtTheirPriorWhenItIsNextDetected) {
  Harness h;
  drive(h, kOld, {kVan}, 0, 8);
  const Track before = only(h);
  ASSERT_TRUE(before.existence > 0.9);
  EXPECT_EQ(classProbability(before, "van"), 0.0);
  drive(h, kNew, {kVan}, 8, 9);
  const Track& after = only(h);
  EXPECT_EQ(after.id, before.id);
  EXPECT_GT(classProbability(after, "van"), 0.0);
  EXPECT_NEAR(sumOfWeights(after), 1.0, 1e-12);
  Ledger published;
  after.classes.publish(published);
  const auto& ledger = published.classes;
  const auto van = std::find_if(ledger.begin(), ledger.end(),
                                [](const ClassLedger& c) { return c.name == "van"; });
  ASSERT_NE(van, ledger.end());
  // Compares car and van, which are equally frequent. Differences to other classes have other
  // causes.
  const double prior = van->log_odds[static_cast<std::size_t>(ClassEvidence::kPrior)];
  EXPECT_NEAR(prior, std::log(0.5 * (1.0 - ClutterParameters{}.other_prior)), 0.1);
  EXPECT_GT(van->log_odds[static_cast<std::size_t>(ClassEvidence::kActivation)], 0.0);
}

TEST(NodeNewClasses, WinWhereTheyAreRightAndTheTrackKeepsItsId) {
  Harness h;
  drive(h, kOld, {kVan}, 0, 12);
  const ObjectId id = only(h).id;
  const double existence = only(h).existence;
  EXPECT_NE(only(h).best().class_name, "van");
  drive(h, kNew, {kVan}, 12, 30);
  EXPECT_EQ(only(h).id, id);
  EXPECT_EQ(only(h).best().class_name, "van");
  EXPECT_GT(classProbability(only(h), "van"), 0.9);
  EXPECT_GT(only(h).existence, std::min(existence, 0.95));
  const State error = only(h).best().x - kVan.x;
  EXPECT_LT(error.head<3>().norm(), 1.0);
}

TEST(NodeNewClasses, AClassThatTheNewModelLacksIsKept) {
  Harness h;
  drive(h, kOld, {kVan, kChair}, 0, 12);
  const auto chairOf = [](const Harness& harness) -> const Track* {
    for (const auto& o : harness.node.belief().tracks) {
      if ((o.best().x - kChair.x).head<3>().norm() < 1.0) return &o;
    }
    return nullptr;
  };
  ASSERT_TRUE(chairOf(h));
  const ObjectId id = chairOf(h)->id;
  ASSERT_EQ(chairOf(h)->best().class_name, "chair");
  drive(h, kCarsOnly, {kVan, kChair}, 12, 20);
  ASSERT_TRUE(chairOf(h));
  EXPECT_EQ(chairOf(h)->id, id);
  EXPECT_EQ(chairOf(h)->best().class_name, "chair");
}

TEST(NodeNewClasses, AnInvisibleTrackKeepsEveryBit) {
  Harness h;
  drive(h, kOld, {kVan}, 0, 10);
  const Track before = only(h);
  h.node.onModel(kNew.info);
  RigidTransform away = driveTo(9, 0.3);
  away.q = away.q * Eigen::Quaterniond(Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitZ()));
  for (std::uint64_t k = 10; k < 20; ++k) {
    h.node.onOdometry(odometryAt(k, away));
    Detections none = testing::detectionsAt(k, {});
    none.model_hash = kNew.info.hash;
    h.node.onDetections(none);
  }
  ASSERT_EQ(only(h).hypotheses.size(), before.hypotheses.size());
  for (std::size_t i = 0; i < before.hypotheses.size(); ++i) {
    EXPECT_EQ(only(h).hypotheses[i].weight, before.hypotheses[i].weight);
    EXPECT_EQ(only(h).hypotheses[i].x, before.hypotheses[i].x);
  }
  drive(h, kNew, {kVan}, 20, 21);
  EXPECT_GT(classProbability(only(h), "van"), 0.0);
}

TEST(NodeNewClasses, SwappingBackAndForthAddsThemOnce) {
  Harness h;
  drive(h, kOld, {kVan}, 0, 8);
  drive(h, kNew, {kVan}, 8, 24);
  ASSERT_GT(classProbability(only(h), "van"), 0.9);
  const double van = classProbability(only(h), "van");
  drive(h, kOld, {kVan}, 24, 26);
  drive(h, kNew, {kVan}, 26, 28);
  EXPECT_GT(classProbability(only(h), "van"), 0.5 * van) << "it did not begin at the prior again";
}

TEST(NodeModelChange, IsAnEventWhenDetectionsOfTheNewModelAreUsed) {
  Harness h;
  drive(h, kOld, {kVan}, 0, 5);
  const auto changes = [&] {
    std::vector<std::string> details;
    for (const Event& e : h.events) {
      if (e.kind == EventKind::kModelChanged) details.push_back(e.detail);
    }
    return details;
  };
  h.node.onModel(kNew.info);
  EXPECT_TRUE(changes().empty()) << "a model that is only there changes nothing";
  drive(h, kNew, {kVan}, 5, 8);
  ASSERT_EQ(changes().size(), 1u);
  EXPECT_EQ(changes()[0], "new instead of old; new classes: van");
  h.node.onOdometry(odometryAt(8, driveTo(8, 0.3)));
  drive(h, kCarsOnly, {kVan}, 9, 10);
  h.node.onDetections(kNew.look({kVan}, 8));  // late, from the earlier model
  ASSERT_EQ(changes().size(), 2u);
  EXPECT_THAT(changes()[1],
              HasSubstr("cars instead of new; kept without new evidence: van, chair"));
}

TEST(NodeModelChange, ARollBackIsAnEventThatSaysWhy) {
  Harness h;
  drive(h, kOld, {kVan}, 0, 5);
  SwapNotice notice;
  notice.step = SwapStep::kTookOver;
  h.node.onSwap(notice);
  EXPECT_NE(h.events.back().kind, EventKind::kModelChanged);
  notice.step = SwapStep::kRolledBack;
  notice.model = "new";
  notice.reason = "empty";
  notice.detail = "14 of 15 frames";
  h.node.onSwap(notice);
  EXPECT_EQ(h.events.back().kind, EventKind::kModelChanged);
  EXPECT_EQ(h.events.back().detail, "new was rolled back, empty: 14 of 15 frames");
}

}  // namespace
}  // namespace perdure::semantic_filter
