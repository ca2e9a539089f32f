#include "services/semantic_filter/core/tracks/context.h"

#include <gtest/gtest.h>

#include <cmath>

#include "services/semantic_filter/core/belief/mixture_ops.h"
#include "services/semantic_filter/core/belief/track_message.h"
#include "tests/services/semantic_filter/scene.h"

namespace perdure::semantic_filter {
namespace {

using testing::makeState;

ContextMatrix matrixOf(double car_car, double car_van, double van_van) {
  ContextMatrix matrix;
  matrix.radius_m = 10.0;
  matrix.classes = {"car", "van"};
  matrix.log_ratio.resize(2, 2);
  matrix.log_ratio << car_car, car_van, car_van, van_van;
  return matrix;
}

Track thingAt(ObjectId id, double x, double car, double r = 0.9) {
  Track o;
  o.id = id;
  o.existence = {r, ExistenceEvidence::kPrior, o.as_of};
  for (const auto& [name, weight] : {std::pair("car", car), std::pair("van", 1.0 - car)}) {
    Hypothesis h;
    h.class_name = name;
    h.weight = weight;
    h.x = makeState(x, 0, 0.7, 0, 4, 1.8, 1.5);
    o.hypotheses.push_back(h);
  }
  normalise(o, ClassEvidence::kPrior);
  return o;
}

ObjectBelief published(const Track& o) {
  ObjectBelief belief = toBelief(o, 0.7);
  addContext(belief, o);
  return belief;
}

double probabilityOf(const ObjectBelief& belief, const std::string& name) {
  for (const auto& c : belief.classes) {
    if (c.name == name) return c.probability;
  }
  return 0.0;
}

double logOddsOfCar(const ObjectBelief& belief) {
  return std::log(probabilityOf(belief, "car") / probabilityOf(belief, "van"));
}

double contextOfCar(const Track& o, const std::vector<Track>& all, const ContextMatrix& matrix) {
  const auto c = contextOf(o, all, matrix);
  return c.at(0).name == "car" ? c[0].value - c[1].value : c[1].value - c[0].value;
}

TEST(Context, IsTheMeanOverTheNeighboursClasses) {
  const auto matrix = matrixOf(0.4, -0.2, 0.1);
  const std::vector<Track> objects = {thingAt(1, 0, 0.5), thingAt(2, 8, 0.7, 0.6)};
  const double car = std::log(0.4 + 0.6 * (0.7 * std::exp(0.4) + 0.3 * std::exp(-0.2)));
  const double van = std::log(0.4 + 0.6 * (0.7 * std::exp(-0.2) + 0.3 * std::exp(0.1)));
  EXPECT_NEAR(contextOfCar(objects[0], objects, matrix), car - van, 1e-12);
}

TEST(Context, ComesOnlyFromNearObjectsAtRest) {
  const auto matrix = matrixOf(2.0, -2.0, 0.0);
  std::vector<Track> objects = {thingAt(1, 0, 0.5), thingAt(2, 10.1, 0.9)};
  EXPECT_EQ(contextOfCar(objects[0], objects, matrix), 0.0);
  objects[1] = thingAt(2, 5, 0.9);
  EXPECT_GT(contextOfCar(objects[0], objects, matrix), 0.5);
  objects[1].hypotheses[0].moving = true;
  EXPECT_EQ(contextOfCar(objects[0], objects, matrix), 0.0);
}

TEST(Context, ChangesNoOddsByMoreThanOneNat) {
  std::vector<Track> objects = {thingAt(1, 0, 0.5)};
  for (ObjectId id = 2; id < 12; ++id)
    objects.push_back(thingAt(id, 0.5 * static_cast<double>(id), 0.99, 0.99));
  contextualise(objects, matrixOf(5.0, -5.0, 5.0));
  const double free = logOddsOfCar(toBelief(objects[0], 0.7));
  EXPECT_NEAR(logOddsOfCar(published(objects[0])) - free, kMostContext, 1e-9);
  for (const Track& o : objects) {
    const double change = logOddsOfCar(published(o)) - logOddsOfCar(toBelief(o, 0.7));
    EXPECT_LE(std::abs(change), kMostContext + 1e-9);
  }
}

TEST(Context, TwoObjectsCannotRaiseEachOtherWithoutEnd) {
  const auto matrix = matrixOf(0.8, -0.8, 0.8);
  std::vector<Track> objects = {thingAt(1, 0, 0.55), thingAt(2, 4, 0.55)};
  const double free = logOddsOfCar(published(objects[0]));
  contextualise(objects, matrix);
  const double once = logOddsOfCar(published(objects[0]));
  EXPECT_GT(once, free + 0.01);
  for (int i = 0; i < 1000; ++i) contextualise(objects, matrix);
  EXPECT_EQ(logOddsOfCar(published(objects[0])), once);
  EXPECT_EQ(classProbability(objects[0], "car"), 0.55);
}

TEST(Context, FollowsMaterialChangesOfVisibleObjects) {
  const auto matrix = matrixOf(1.0, -1.0, 1.0);
  std::vector<Track> objects = {thingAt(1, 0, 0.5), thingAt(2, 4, 0.8)};
  contextualise(objects, matrix);
  const double before = logOddsOfCar(published(objects[0]));
  objects[1] = thingAt(2, 4, 0.81);
  contextualise(objects, matrix);
  EXPECT_EQ(logOddsOfCar(published(objects[0])), before);
  objects[1] = thingAt(2, 4, 0.2);
  objects[0].visible_fraction = 0.0;
  contextualise(objects, matrix);
  EXPECT_EQ(logOddsOfCar(published(objects[0])), before);
  objects[0].visible_fraction = 1.0;
  contextualise(objects, matrix);
  EXPECT_LT(logOddsOfCar(published(objects[0])), -0.1);
}

TEST(Context, IsRemovedFromARecalledObject) {
  std::vector<Track> objects = {thingAt(1, 0, 0.45), thingAt(2, 4, 0.9)};
  contextualise(objects, matrixOf(1.5, -1.5, 1.5));
  ObjectBelief belief = published(objects[0]);
  EXPECT_EQ(belief.best().name, "car");  // because of the context
  removeContext(belief);
  EXPECT_EQ(belief.best().name, "van");
  EXPECT_NEAR(probabilityOf(belief, "car"), 0.45, 1e-12);
  EXPECT_EQ(belief.why, toBelief(objects[0], 0.7).why);
}

TEST(Context, NeverEntersTheRecursion) {
  const CameraModel camera{testing::makeCamera()};
  const std::vector<testing::TrueObject> street = {
      {makeState(18, 3.5, 0.75, 0.1, 4.4, 1.8, 1.7), "car"},
      {makeState(24, 4.0, 0.75, 0.0, 4.6, 1.8, 1.7), "van"},
      {makeState(26, -4.0, 0.75, 3.0, 4.6, 1.8, 1.8), "van"}};
  ClassPriors priors = testing::makePriors();
  std::vector<Objects> plain, laid;
  Node without({}, priors, 9, {[&](const Objects& m) { plain.push_back(m); }, {}, {}});
  priors.context = matrixOf(2.0, -1.0, 0.5);
  Node with({}, priors, 9, {[&](const Objects& m) { laid.push_back(m); }, {}, {}});
  std::mt19937 random(2);
  for (Node* node : {&without, &with}) {
    node->onCalibration(testing::calibrationOf(testing::makeCamera()));
    node->onModel(testing::makeModelInfo());
  }
  for (std::uint64_t k = 0; k < 25; ++k) {
    View view;
    view.camera = &camera;
    view.T_WB = testing::driveTo(k, 0.3);
    std::vector<Detection> boxes;
    for (const auto& o : street) {
      auto d = testing::detect(o, view, BoxParameters{}, 0.5, 2.0, random);
      if (!d) continue;
      d->activations = {0.0F, 2.0F, -2.0F, -2.0F, 1.7F};  // a car, or possibly a van
      boxes.push_back(*d);
    }
    for (Node* node : {&without, &with}) {
      node->onOdometry(testing::odometryAt(k, view.T_WB));
      node->onDetections(testing::detectionsAt(k, boxes));
    }
  }
  ASSERT_GE(without.belief().tracks.size(), 3U);
  ASSERT_EQ(with.belief().tracks.size(), without.belief().tracks.size());
  bool differs = false;
  for (std::size_t j = 0; j < with.belief().tracks.size(); ++j) {
    const Track &a = with.belief().tracks[j], &b = without.belief().tracks[j];
    EXPECT_EQ(double{a.existence}, double{b.existence});
    ASSERT_EQ(a.hypotheses.size(), b.hypotheses.size());
    for (std::size_t i = 0; i < a.hypotheses.size(); ++i) {
      EXPECT_EQ(a.hypotheses[i].weight, b.hypotheses[i].weight);
      EXPECT_EQ(a.hypotheses[i].x, b.hypotheses[i].x);
    }
    EXPECT_TRUE(b.context.empty());
  }
  for (std::size_t k = 0; k < laid.size(); ++k) {
    for (std::size_t j = 0; j < laid[k].objects.size(); ++j) {
      const auto &a = laid[k].objects[j], &b = plain[k].objects[j];
      differs = differs || std::abs(a.best().probability - b.best().probability) > 0.01;
    }
  }
  EXPECT_TRUE(differs);  // otherwise the test proves nothing
}

}  // namespace
}  // namespace perdure::semantic_filter
