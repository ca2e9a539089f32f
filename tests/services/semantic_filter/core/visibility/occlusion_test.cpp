#include "services/semantic_filter/core/visibility/occlusion.h"

#include <gtest/gtest.h>

#include <random>

#include "tests/services/semantic_filter/scene.h"

namespace perdure::semantic_filter {
namespace {

using testing::makeCamera;
using testing::makeState;

class Occlusion : public ::testing::Test {
 protected:
  Occlusion() {
    view.camera = &camera;
    view.T_WB = RigidTransform(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0, 0, 1.0));
  }
  Outline outline(ObjectId id, const State& x, double solidity = 1.0, double sigma = 0.1) const {
    return {id,
            solidity,
            (x.head<3>() - view.T_WC().p).norm(),
            sigma,
            0.5 * std::exp(x[4]),
            projectOutline(x, view)};
  }
  ScratchVector<TrackVisibility> seeThem(const ScratchVector<Outline>& o,
                                         const std::vector<LandmarkDepth>& points = {}) const {
    return computeVisibility(o, points, camera, {});
  }
  CameraModel camera{makeCamera()};
  View view;
};

TEST_F(Occlusion, OfTwoCarsInLineTheFrontOneHidesTheRearOne) {
  const auto s = seeThem({outline(7, makeState(25, 0, 0.75, 0, 4.2, 1.7, 1.5)),
                          outline(3, makeState(10, 0, 0.75, 0, 4.2, 1.8, 1.7))});
  EXPECT_EQ(s[0].state, Visibility::kOccluded);
  EXPECT_EQ(s[0].fraction, 0.0);
  EXPECT_EQ(s[0].blocked_by, 3u);
  EXPECT_EQ(s[1].state, Visibility::kVisible);
  EXPECT_EQ(s[1].fraction, 1.0);
}

TEST_F(Occlusion, AHalfHiddenCarIsPartialAndItsHiddenSideIsKnown) {
  const auto s = seeThem({outline(7, makeState(30, 1.5, 0.75, M_PI / 2, 4.2, 1.7, 1.5)),
                          outline(3, makeState(10, 1.3, 0.75, 0, 3.0, 1.8, 2.5))});
  EXPECT_EQ(s[0].state, Visibility::kPartial);
  EXPECT_GT(s[0].fraction, 0.2);
  EXPECT_LT(s[0].fraction, 0.8);
  EXPECT_TRUE(s[0].hidden_sides[0]);  // the left of the body is the left of the image
  EXPECT_FALSE(s[0].hidden_sides[2]);
}

// The camera is beside one end of a couch. Rays of random directions count how much of it is seen.
TEST_F(Occlusion, TheShareInTheImageIsThatOfTheSolidAngle) {
  const State couch = makeState(1.9, -0.8, 1.5, 0.3, 1.9, 0.95, 0.4);
  const Eigen::Matrix3d R_OW = uprightRotation(couch[kYaw], view.up_W).transpose();
  const RigidTransform T_WC = view.T_WC();
  const Eigen::Array3d half = 0.5 * couch.segment<3>(kSize).array().exp();
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  double hits = 0.0, seen = 0.0;
  for (int i = 0; i < 400'000; ++i) {
    const Eigen::Vector3d ray = Eigen::Vector3d(normal(random), normal(random), normal(random));
    const Eigen::Array3d from = R_OW * (T_WC.p - couch.head<3>()), along = R_OW * (T_WC.q * ray);
    const Eigen::Array3d a = (-half - from) / along, b = (half - from) / along;
    if (std::max(0.0, a.min(b).maxCoeff()) > a.max(b).minCoeff()) continue;
    const auto pixel = camera.project(ray);
    hits += 1.0;
    seen += pixel && camera.inImage(*pixel);
  }
  const double fraction = seeThem({outline(7, couch)}).front().fraction;
  ASSERT_GT(hits, 10'000);
  EXPECT_GT(fraction, 0.25);
  EXPECT_LT(fraction, 0.8);
  EXPECT_NEAR(fraction, seen / hits, 0.02);
}

TEST_F(Occlusion, PaintingOnAnotherGridLeavesNothingBehind) {
  const auto rear = outline(7, makeState(30, 1.5, 0.75, M_PI / 2, 4.2, 1.7, 1.5));
  const auto front = outline(3, makeState(10, 1.3, 0.75, 0, 3.0, 1.8, 2.5));
  const auto share = [&](const ScratchVector<Outline>& things, std::int64_t cell_px) {
    VisibilityParameters parameters;
    parameters.cell_px = cell_px;
    return computeVisibility(things, {}, camera, parameters).front().fraction;
  };
  const double coarse = share({rear, front}, 8), fine = share({rear, front}, 2);
  ASSERT_NEAR(coarse, fine, 0.15);
  ASSERT_LT(fine, 0.8);
  for (const std::int64_t cell_px : {2, 8, 1, 3, 2}) {
    EXPECT_EQ(share({rear}, cell_px), 1.0) << cell_px;
    share({rear, front}, cell_px);
  }
  EXPECT_EQ(share({rear, front}, 8), coarse);
  EXPECT_EQ(share({rear, front}, 2), fine);
}

TEST_F(Occlusion, ADoubtfulObjectHidesNothing) {
  const auto s = seeThem({outline(7, makeState(25, 0, 0.75, 0, 4.2, 1.7, 1.5)),
                          outline(3, makeState(10, 0, 0.75, 0, 4.2, 1.8, 1.7), 0.3)});
  EXPECT_EQ(s[0].fraction, 1.0);
}

TEST_F(Occlusion, BehindAndBesideTheCameraAreDistinguished) {
  const auto s = seeThem({outline(1, makeState(-25, 0, 0.75, 0, 4.2, 1.7, 1.5)),
                          outline(2, makeState(12, 30, 0.75, 0, 4.2, 1.7, 1.5))});
  EXPECT_EQ(s[0].state, Visibility::kBehind);
  EXPECT_EQ(s[1].state, Visibility::kOutOfView);
  EXPECT_EQ(s[1].fraction, 0.0);
}

TEST_F(Occlusion, AVisibleFractionBelowTheMinimumIsAPartialView) {
  const double least = VisibilityParameters{}.minimum;
  const auto s = seeThem({outline(1, makeState(25, 2.1, 0.75, 0, 4.2, 1.7, 1.5)),
                          outline(2, makeState(10, 0, 0.75, 0, 4.2, 1.8, 1.7)),
                          outline(3, makeState(12, 11.3, 0.75, 0, 4.2, 1.7, 1.5)),
                          outline(4, makeState(12, 30, 0.75, 0, 4.2, 1.7, 1.5))});
  EXPECT_EQ(s[0].state, Visibility::kOccluded);
  EXPECT_EQ(s[2].state, Visibility::kOutOfView);
  for (const int j : {0, 2}) {
    EXPECT_EQ(s[j].fraction, 0.0);
    EXPECT_GT(s[j].residual_fraction, 0.0) << "object " << j;
    EXPECT_LT(s[j].residual_fraction, least);
  }
  EXPECT_EQ(s[1].residual_fraction, 0.0);
  EXPECT_EQ(s[3].residual_fraction, 0.0);
}

TEST_F(Occlusion, LandmarksInFrontHideAndLandmarksBehindCountAgainst) {
  const Outline car = outline(1, makeState(25, 0, 0.75, 0, 4.2, 1.7, 1.5));
  const auto& b = car.box->sides;
  std::vector<LandmarkDepth> points;
  for (int i = 0; i < 40; ++i) {
    const double s = 0.2 + 0.6 * i / 40.0;
    points.push_back({{b[0] + s * (b[2] - b[0]), 0.5 * (b[1] + b[3])}, 6.0, 0.1});
  }
  EXPECT_EQ(seeThem({car}, points)[0].state, Visibility::kOccluded);
  for (auto& p : points) p.distance_m = 26.0;
  EXPECT_EQ(seeThem({car}, points)[0].state, Visibility::kVisible);
}

}  // namespace
}  // namespace perdure::semantic_filter
