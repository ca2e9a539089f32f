#include "services/semantic_filter/core/tracks/cuboid_fit.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/services/semantic_filter/scene.h"

namespace perdure::semantic_filter {
namespace {

using testing::makeState;

class FitCuboid : public ::testing::Test, protected testing::UsualFrame {};

TEST_F(FitCuboid, RecoversSizeAndPlaceFromAnExactBoxAtTheTrueYaw) {
  frame.view.T_WB = RigidTransform(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0, 0, 1.2));
  // the mean size of the prior
  const State truth = makeState(14.0, 3.0, 0.75, 0.6, 4.2, 1.75, 1.5);
  const auto s = projectCuboid(truth, frame.view)->sides;
  Detection d;
  d.box = {s[0], s[1], s[2], s[3]};
  d.activations = {0, 2, -2, -2, -2};
  const auto e = *makeBoxDetection(d, model, camera.width(), camera.height(), parameters.box, {});
  const auto fit = fitCuboid(e, priors.of("car"), 0.6, 0.05, std::nullopt, frame);
  ASSERT_TRUE(fit);
  EXPECT_LT((fit->hypothesis.x - truth).head<3>().norm(), 0.05);
  EXPECT_LT((fit->hypothesis.x - truth).segment<3>(kSize).norm(), 0.01);
  EXPECT_LT(fit->cost, 0.1);  // the remainder is due to the weak prior at the start
  const double depth_sigma = std::sqrt(fit->hypothesis.P(0, 0));
  EXPECT_GT(depth_sigma, 0.05 * 14.0);  // the size prior does not allow a smaller value
  EXPECT_LT(depth_sigma, 0.2 * 14.0);
}

TEST_F(FitCuboid, ABoxThatTheBorderCutsInBothAxesNeedsTheRangeOfLandmarks) {
  const State truth = makeState(6.0, -1.0, 0.75, 0.6, 4.2, 1.75, 1.5);
  const auto s = projectCuboid(truth, frame.view)->sides;
  Detection d;
  d.box = {s[0], s[1], s[2], s[3]};
  d.activations = {0, 2, -2, -2, -2};
  auto e = *makeBoxDetection(d, model, camera.width(), camera.height(), parameters.box, {});
  e.z.measured = {true, true, false, false};
  EXPECT_FALSE(fitCuboid(e, priors.of("car"), 0.6, 0.05, std::nullopt, frame));
  const double range = (truth.head<3>() - frame.view.T_WC().p).norm();
  const auto fit = fitCuboid(e, priors.of("car"), 0.6, 0.05, RangeHint{range, 0.3}, frame);
  ASSERT_TRUE(fit);
  EXPECT_NEAR((fit->hypothesis.x.head<3>() - frame.view.T_WC().p).norm(), range, 0.3);
  EXPECT_LT((fit->hypothesis.x - truth).head<3>().norm(), 0.5);
}

TEST_F(FitCuboid, LandmarksNearTheCentreGiveTheDepthDespiteABackground) {
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

}  // namespace
}  // namespace perdure::semantic_filter
