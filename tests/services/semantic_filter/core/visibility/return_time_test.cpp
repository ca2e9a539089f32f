#include "services/semantic_filter/core/visibility/return_time.h"

#include <gtest/gtest.h>

#include <random>

#include "services/semantic_filter/core/visibility/occlusion.h"
#include "services/semantic_filter/return_events.h"
#include "tests/services/semantic_filter/scene.h"

namespace perdure::semantic_filter {
namespace {

using testing::makeCamera;
using testing::makeState;

constexpr double kFrame_s = 0.1;

Track standing(ObjectId id, const State& x, double sigma_m) {
  Track object;
  object.id = id;
  object.existence.become(0.99, ExistenceEvidence::kPrior, {});
  object.life.confirmed = true;
  Hypothesis h;
  h.class_name = "car";
  h.weight = 1.0;
  h.x = x;
  h.P = 1e-6 * StateCovariance::Identity();
  h.P.topLeftCorner<2, 2>().diagonal().setConstant(sigma_m * sigma_m);
  object.hypotheses.push_back(h);
  return object;
}

/// A car behind a van, and a body that passes both on their left.
class ReturnTime : public ::testing::Test {
 protected:
  explicit ReturnTime(double sigma_m = 0.0) {
    objects = {standing(3, makeState(10, 0, 1.0, 0, 4.2, 1.8, 2.0), sigma_m),
               standing(7, makeState(25, 0, 0.75, 0, 4.2, 1.7, 1.5), sigma_m)};
    objects[1].visibility.blocked_by = 3;
    objects[1].visibility.state = Visibility::kOccluded;
    now.view.camera = &camera;
    now.view.T_WB = RigidTransform(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0, 0, 1.0));
    way.step.p = Eigen::Vector3d(0.0, 0.1, 0.0);
    way.seconds = kFrame_s;
  }
  std::optional<ReappearanceInterval> foresee() const {
    return reappearanceInterval(objects, objects[1], now, way, VisibilityParameters{});
  }
  /// The time at which the car may be detected if the body moves as predicted and the objects do
  /// not move.
  double seenAt(const std::vector<Track>& truth) const {
    View view = now.view;
    VisibilityParameters parameters;
    parameters.cell_px = 1;
    parameters.minimum *= 0.5;
    for (int n = 1; n < 100; ++n) {
      view.T_WB = view.T_WB * way.step;
      const auto visibilities = computeVisibility({outlineOf(truth[1], truth[1].best().x, view),
                                                   outlineOf(truth[0], truth[0].best().x, view)},
                                                  {}, camera, parameters);
      if (visibilities[0].fraction > 0.0) return n * kFrame_s;
    }
    return 1e9;
  }
  CameraModel camera{makeCamera()};
  std::vector<Track> objects;
  FrameInput now;
  Way way;
};

TEST_F(ReturnTime, AnExactlyPlacedObjectReappearsInThePredictedFrame) {
  const auto foreseen = foresee();
  ASSERT_TRUE(foreseen);
  EXPECT_NEAR(foreseen->expected, seenAt(objects), 1e-9);
  EXPECT_GT(foreseen->expected, 0.3);
  EXPECT_LT(foreseen->expected - foreseen->earliest, 1.5 * kFrame_s);
  EXPECT_GT(foreseen->latest - foreseen->expected, kFrame_s) << "a sliver is not found at once";
  EXPECT_LT(foreseen->latest - foreseen->expected, 12.0 * kFrame_s);
}

TEST_F(ReturnTime, AnUndetectedSliverIsExpectedWhenMoreOfItIsVisible) {
  const auto first = foresee();
  ASSERT_TRUE(first);
  const double frames = first->expected / kFrame_s;
  now.view.T_WB.p += frames * way.step.p;  // it could have been detected by now
  const auto later = foresee();
  ASSERT_TRUE(later);
  EXPECT_GT(later->expected, 1.5 * kFrame_s);
  way.step.p *= 1e-3;
  EXPECT_FALSE(foresee()) << "a body that all but stands does not see it in its next frame";
}

TEST_F(ReturnTime, RoundObjectsHideLessThanTheirCuboids) {
  const auto of_cuboids = foresee();
  auto styles = std::make_shared<BoxStyles>();
  styles->by_class["car"].shape = shapeOf({{-1.0, 0.8, 0.8, 0.7}, {1.0, 0.8, 0.8, 0.7}});
  Model model;
  model.styles = styles;
  now.model = std::make_shared<const Model>(std::move(model));
  const auto of_shapes = foresee();
  ASSERT_TRUE(of_cuboids && of_shapes);
  EXPECT_LT(of_shapes->expected, of_cuboids->expected - 0.5 * kFrame_s);
}

TEST_F(ReturnTime, NothingReappearsBeforeABodyAtRest) {
  way.step.p.setZero();
  EXPECT_FALSE(foresee());
}

TEST_F(ReturnTime, TheIntervalIsWiderIfTheVelocityWanders) {
  const auto steady = foresee();
  way.speed_walk = 0.5;
  const auto wandering = foresee();
  ASSERT_TRUE(steady && wandering);
  EXPECT_EQ(steady->expected, wandering->expected);
  EXPECT_GT(wandering->latest - wandering->earliest, 2.0 * (steady->latest - steady->earliest));
}

class ReturnTimeOfUncertainPlaces : public ReturnTime {
 protected:
  ReturnTimeOfUncertainPlaces() : ReturnTime(0.15) {}
};

TEST_F(ReturnTimeOfUncertainPlaces, TheIntervalHoldsNineInTen) {
  const auto foreseen = foresee();
  ASSERT_TRUE(foreseen);
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  constexpr int kDraws = 200;
  int inside = 0;
  for (int n = 0; n < kDraws; ++n) {
    auto truth = objects;
    for (auto& o : truth) {
      for (int i = 0; i < 2; ++i) o.hypotheses[0].x[i] += 0.15 * normal(random);
    }
    const double seen = seenAt(truth);
    inside += foreseen->earliest <= seen && seen <= foreseen->latest;
  }
  EXPECT_GE(inside, 0.85 * kDraws);
  EXPECT_LE(inside, 0.99 * kDraws) << "it says less than is known";
}

TEST_F(ReturnTime, TheTimeIsPublishedWhenTheObjectIsOccludedAndAgainAsItComesNear) {
  ReappearanceMonitor watch;
  std::vector<Event> said;
  const double seen = seenAt(objects);
  for (double t = 0.0; t < seen - 0.5 * kFrame_s; t += kFrame_s) {
    View next = now.view;
    next.T_WB = next.T_WB * way.step;
    const ComingFrame coming{next, kFrame_s};
    for (const Event& e : watch.update(objects, now, coming, Parameters{}, Event{})) {
      said.push_back(e);
      EXPECT_NEAR(t + e.returns_in_s[0], seen, 1.01 * kFrame_s);
    }
    now.view = next;
    now.stamp.time += std::chrono::milliseconds(100);
  }
  ASSERT_GE(said.size(), 2U);
  EXPECT_LE(said.size(), 10U);
  EXPECT_EQ(said[0].kind, EventKind::kPredictedReturn);
  EXPECT_EQ(said[0].object_id, 7U);
  EXPECT_EQ(said[0].other_id, 3U);
}

TEST_F(ReturnTime, AnObjectThatShouldBeVisibleIsExpectedUntilItIsDetected) {
  ReappearanceMonitor watch;
  std::vector<double> said;
  const auto oneFrame = [&](double left_m) {
    View next = now.view;
    next.T_WB.p.y() += left_m;
    for (const Event& e :
         watch.update(objects, now, ComingFrame{next, kFrame_s}, Parameters{}, Event{})) {
      said.push_back(e.returns_in_s[0]);
    }
    now.view = next;
    now.stamp.time += std::chrono::milliseconds(100);
  };
  oneFrame(0.1);
  ASSERT_EQ(said.size(), 1u);
  objects[1].visibility.state =
      Visibility::kPartial;  // visibility by the visible fraction, although no box exists
  objects[1].visibility.fraction = 0.3;
  now.view.T_WB.p.y() = 3.0;
  said.clear();
  for (int i = 0; i < 10; ++i) oneFrame(0.1);
  ASSERT_GE(said.size(), 3u);
  EXPECT_LE(said.size(), 5u) << "not with every frame";
  for (const double s : said) EXPECT_NEAR(s, kFrame_s, 1e-9);
  said.clear();
  objects[1].life.hits += 1;
  for (int i = 0; i < 10; ++i) oneFrame(0.1);
  EXPECT_TRUE(said.empty());
}

}  // namespace
}  // namespace perdure::semantic_filter
