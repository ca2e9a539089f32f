#include "services/semantic_filter/core/smoothing/mode_search.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "common/math/chi2.h"
#include "common/math/so3.h"
#include "services/semantic_filter/core/belief/ground_surface.h"
#include "services/semantic_filter/core/belief/track_message.h"
#include "services/semantic_filter/core/smoothing/refit.h"
#include "tests/services/semantic_filter/core/smoothing/passing_car.h"

namespace perdure::semantic_filter {
namespace {

using testing::makePriors;
using testing::makeState;
using testing::parkedCar;
using testing::Passing;

/// A track in the wrong mode of yaw, under which the boxes are less likely.
Track turnedBy(double angle, const Passing& scene) {
  Hypothesis h = scene.start(false);
  h.x[kYaw] = wrapAngle(h.x[kYaw] + angle);
  Track object;
  object.hypotheses = {h};
  object.batch.keyframes = scene.keyframes();
  object.batch.seen = static_cast<std::uint32_t>(object.batch.keyframes.size());
  return object;
}

TEST(ModeSearch, FindsTheYawThatTheFilterPruned) {
  int found = 0;
  constexpr int kRuns = 20;
  for (unsigned seed = 1; seed <= kRuns; ++seed) {
    const Passing scene(seed);
    Track object = turnedBy(M_PI / 2, scene);
    refit(object, scene.frame());
    const double error = std::remainder(object.best().x[kYaw] - scene.truth()[kYaw], M_PI);
    found += std::abs(error) < 0.2 ? 1 : 0;
    // The next mode search is due after the same number of new keyframes.
    EXPECT_EQ(object.batch.mode_search_due, 2 * scene.keyframes().size());
  }
  EXPECT_GE(found, 17) << "of " << kRuns;
}

/// The latest frame, above a ground at `height` (m).
FrameContext overGround(double height, const Passing& scene) {
  FrameContext frame = scene.frame();
  BodyPath path;
  for (double x = 0.0; x <= 24.0; x += 4.0) path.advance({x, 0.0, 1.2});
  GroundParameters ground;
  ground.body_height_m = 1.2 - height;
  frame.ground = std::make_shared<const GroundSurface>(
      std::vector<Track>{}, path, GroundRoughness{}, frame.view.up_W, *frame.priors, ground);
  return frame;
}

/// Whether a car at rest has a moving hypothesis after its refit.
bool mayMoveOver(double height, const Passing& scene) {
  const FrameContext frame = overGround(height, scene);
  Track object = turnedBy(0.0, scene);
  refit(object, frame);
  const auto& hs = object.hypotheses.read();
  return std::any_of(hs.begin(), hs.end(), [](const Hypothesis& h) { return h.moving; });
}

TEST(ModeSearch, ATrackBelowTheGroundMayMoveInstead) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    const Passing scene(seed);
    const double underside = scene.truth()[2] - 0.5 * std::exp(scene.truth()[kSize + 2]);
    EXPECT_FALSE(mayMoveOver(underside, scene)) << seed;
    EXPECT_TRUE(mayMoveOver(underside + 0.8, scene)) << seed;
  }
}

/// The class of an *other* track after all keyframes of a car, if the network prefers
/// `lookalike_class`.
std::string classAfterAll(const Passing& scene, const std::string& lookalike_class) {
  Track object = turnedBy(0.0, scene);
  object.hypotheses.front().class_name = kOtherClass;
  object.lookalike.class_name = lookalike_class;
  refit(object, scene.frame());
  return object.best().class_name;
}

TEST(ModeSearch, OtherBecomesTheClassItResemblesIfAllKeyframesFit) {
  int cars = 0;
  constexpr int kRuns = 20;
  for (unsigned seed = 1; seed <= kRuns; ++seed) {
    cars += classAfterAll(Passing(seed), "car") == "car" ? 1 : 0;
    EXPECT_EQ(classAfterAll(Passing(seed), "chair"), kOtherClass) << "of a car's size";
    EXPECT_EQ(classAfterAll(Passing(seed), "unicorn"), kOtherClass) << "of no known size";
    EXPECT_EQ(classAfterAll(Passing(seed), ""), kOtherClass);
  }
  EXPECT_GE(cars, 17) << "of " << kRuns;
}

/// The cabin of that car: the part that is visible above an unmapped hedge.
State cabin() {
  const double top = parkedCar()[2] + 0.5 * std::exp(parkedCar()[kSize + 2]), height = 0.5;
  return makeState(32.0, 5.0, top - 0.5 * height, 0.15, 2.2, 1.8, height);
}

Track otherLikeACar(const Passing& scene) {
  Track object = turnedBy(0.0, scene);
  object.hypotheses.front().class_name = kOtherClass;
  object.lookalike.class_name = "car";
  return object;
}

TEST(ModeSearch, OtherBecomesTheUpperPartOfTheClassItResembles) {
  constexpr int kRuns = 20;
  int cars = 0, placed = 0, high = 0;
  for (unsigned seed = 1; seed <= kRuns; ++seed) {
    const Passing scene(seed, 0.0, 0.0, cabin());
    Track object = otherLikeACar(scene);
    refit(object, scene.frame());
    if (object.best().class_name != "car" || !object.best().upper_part) continue;
    ++cars;
    const ClassBelief published = toBelief(object, *scene.frame().priors, 0.7).best();
    const Eigen::Vector3d d = published.mean.head<3>() - parkedCar().head<3>();
    const Eigen::Matrix3d P = published.covariance.topLeftCorner<3, 3>();
    placed += d.dot(P.ldlt().solve(d)) < chi2Quantile(0.99, 3) ? 1 : 0;
    const double height = published.mean[kSize + 2] - parkedCar()[kSize + 2];
    high += height * height < 9.0 * published.covariance(kSize + 2, kSize + 2) ? 1 : 0;
  }
  EXPECT_GE(cars, 17) << "of " << kRuns;
  EXPECT_GE(placed, cars - 1);
  EXPECT_GE(high, cars - 1);
}

TEST(ModeSearch, NothingIsAnUpperPartIfAllIsAlwaysSeen) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    Passing scene(seed, 0.0, 0.0, cabin());
    scene.parameters().box.partial_view = 0.0;
    Track object = otherLikeACar(scene);
    refit(object, scene.frame());
    EXPECT_EQ(object.best().class_name, kOtherClass) << seed;
  }
}

TEST(ModeSearch, TheGroundSpeaksAgainstAnUpperPartThatStandsOnIt) {
  const Passing scene(1, 0.0, 0.0, cabin());
  const double underside = cabin()[2] - 0.5 * std::exp(cabin()[kSize + 2]);
  Hypothesis h = scene.start(false);
  h.x = cabin();
  h.P *= 1e-3;
  h.upper_part = true;
  const double behind_a_hedge = besideKeyframes(h, 99, overGround(parkedCar()[2] - 0.725, scene));
  EXPECT_GT(behind_a_hedge, besideKeyframes(h, 99, overGround(underside, scene)) + 3.0);
}

TEST(ModeSearch, AnUpperPartBecomesTheWholeObjectOnceThatIsSeen) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    const Passing scene(seed);
    Track object = turnedBy(0.0, scene);
    object.hypotheses.front().upper_part = true;
    object.hypotheses.front().x.head<kBias>() = cabin().head<kBias>();
    refit(object, scene.frame());
    EXPECT_EQ(object.best().class_name, "car") << seed;
    EXPECT_FALSE(object.best().upper_part) << seed;
  }
}

TEST(ModeSearch, ModesThatTheKeyframesDoNotDistinguishArePublishedAsOneWideGaussian) {
  const Passing scene(4);
  Track object = turnedBy(0.0, scene);
  Hypothesis turned = object.hypotheses.front();
  object.hypotheses.front().weight = 0.6;
  turned.weight = 0.4;
  turned.x[kYaw] += 1.0;
  turned.P(kYaw, kYaw) = object.hypotheses.front().P(kYaw, kYaw) = 0.01;
  object.hypotheses.push_back(turned);
  const ObjectBelief belief = toBelief(object, makePriors(), 0.7);
  EXPECT_NEAR(belief.best().mean[3], object.best().x[kYaw], 1e-12);
  EXPECT_NEAR(belief.best().covariance(3, 3), 0.01 + 0.4 * 1.0, 1e-9);
}

}  // namespace
}  // namespace perdure::semantic_filter
