#include "common/mapping/appearance/view_builder.h"

#include <gtest/gtest.h>

#include <numbers>

namespace perdure::mapping {
namespace {

Landmark landmarkAt(std::uint64_t id, const Eigen::Vector3d& p_W, double sigma) {
  Landmark landmark;
  landmark.id = id;
  landmark.p_W = p_W;
  landmark.covariance = sigma * sigma * Eigen::Matrix3d::Identity();
  landmark.descriptor.fill(static_cast<std::uint8_t>(id));
  return landmark;
}

const RigidTransform kNoTurn;

TEST(ViewBuilder, GivesPointsInTheAnchorsAxes) {
  ViewBuilder builder;
  Landmarks landmarks;
  landmarks.landmarks = {landmarkAt(1, {10.0, 2.0, 1.0}, 0.3)};
  builder.add(landmarks, Eigen::Vector3d::Zero(), 5.0);
  const RigidTransform T_WA(
      Eigen::Quaterniond(Eigen::AngleAxisd(0.5 * std::numbers::pi, Eigen::Vector3d::UnitZ())),
      {10.0, 0.0, 0.0});
  const View view = builder.viewFrom(T_WA, 5.0, 10.0);
  ASSERT_EQ(view.size(), 1u);
  EXPECT_LT((view[0].p - Eigen::Vector3f(2.0F, 0.0F, 1.0F)).norm(), 1e-5F);
  EXPECT_FLOAT_EQ(view[0].sigma, 0.3F);
  EXPECT_EQ(view[0].descriptor[31], 1);
}

TEST(ViewBuilder, LeavesOutWhatSaysLittle) {
  ViewBuilder builder;
  Landmarks landmarks;
  landmarks.landmarks = {landmarkAt(1, {10.0, 0.0, 0.0}, 0.3), landmarkAt(2, {10.0, 1.0, 0.0}, 1.5),
                         landmarkAt(3, {90.0, 0.0, 0.0}, 0.3), landmarkAt(4, {8.0, 0.0, 0.0}, 0.1)};
  landmarks.landmarks.back().descriptor = {};
  builder.add(landmarks, Eigen::Vector3d::Zero(), 0.0);
  const View view = builder.viewFrom(kNoTurn, 0.0, 10.0);
  ASSERT_EQ(view.size(), 1u) << "placed badly, far away, and without a descriptor";
  EXPECT_EQ(view[0].descriptor[0], 1);
}

TEST(ViewBuilder, DoesNotGrowWhileTheBodyRests) {
  ViewBuilder builder;
  for (std::uint64_t message = 0; message < 100; ++message) {
    Landmarks landmarks;
    for (std::uint64_t k = 0; k < 50; ++k) {
      landmarks.landmarks.push_back(landmarkAt(1 + 50 * message + k, {10.0, 0.0, 1.0}, 0.1));
    }
    builder.add(landmarks, Eigen::Vector3d::Zero(), 3.0);
  }
  EXPECT_LE(builder.size(), 2000u);
  const View view = builder.viewFrom(kNoTurn, 3.0, 10.0);
  ASSERT_EQ(view.size(), kMostPoints);
  EXPECT_GT(builder.size(), 1000u);
}

TEST(ViewBuilder, KeepsTheBestPlacedOnesAndForgetsTheWayBehind) {
  ViewBuilder builder;
  Landmarks landmarks;
  for (std::uint64_t id = 1; id <= 100; ++id) {
    const double sigma = 0.005 * static_cast<double>(id);
    landmarks.landmarks.push_back(landmarkAt(id, {10.0, 0.0, static_cast<double>(id)}, sigma));
  }
  builder.add(landmarks, {0.0, 0.0, 0.0}, 0.0);
  View view = builder.viewFrom(kNoTurn, 0.0, 10.0);
  ASSERT_EQ(view.size(), kMostPoints);
  EXPECT_EQ(builder.viewFrom(kNoTurn, 11.0, 10.0).size(), 0u) << "seen too far back";
  landmarks.landmarks = {landmarkAt(7, {10.0, 0.0, 7.5}, 0.01)};
  builder.add(landmarks, Eigen::Vector3d::Zero(), 45.0);
  view = builder.viewFrom(kNoTurn, 45.0, 1000.0);
  ASSERT_EQ(view.size(), 1u) << "what is behind is forgotten";
  EXPECT_FLOAT_EQ(view[0].p.z(), 7.5F) << "as it was seen last";
  builder.clear();
  EXPECT_TRUE(builder.viewFrom(kNoTurn, 45.0, 1000.0).empty());
}

}  // namespace
}  // namespace perdure::mapping
