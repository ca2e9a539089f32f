// Converts camera and frame information of ROS into Perdure's calibration.
#include "common/ros/sensors.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace perdure::ros {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

CameraInfo info(const std::string& model, std::vector<double> d) {
  CameraInfo info;
  info.width = 640, info.height = 480;
  info.distortion_model = model;
  info.d = std::move(d);
  info.k = {500, 0, 320, 0, 510, 240, 0, 0, 1};
  info.p = {400, 0, 310, 0, 0, 410, 230, 0, 0, 0, 1, 0};
  return info;
}

TEST(RosCamera, HasItsLensByTheNamesOfRos) {
  const auto plumb = cameraOf(info("plumb_bob", {-0.28, 0.07, 0.0002, 1.8e-5, 0}), false);
  ASSERT_TRUE(plumb);
  EXPECT_EQ(plumb->distortion, DistortionModel::kRadialTangential);
  EXPECT_THAT(plumb->distortion_coefficients, ElementsAre(-0.28, 0.07, 0.0002, 1.8e-5));
  EXPECT_EQ(plumb->fy, 510);
  EXPECT_EQ(cameraOf(info("equidistant", {1, 2, 3, 4}), false)->distortion,
            DistortionModel::kEquidistant);
  EXPECT_EQ(cameraOf(info("rational_polynomial", {1, 2, 3, 4, 5, 6, 7, 8}), false)->distortion,
            DistortionModel::kRational);
  EXPECT_EQ(cameraOf(info("", {0, 0, 0, 0, 0}), false)->distortion, DistortionModel::kNone);
}

TEST(RosCamera, OfRectifiedImagesIsP) {
  const auto camera = cameraOf(info("plumb_bob", {-0.28, 0.07, 0, 0, 0}), true);
  ASSERT_TRUE(camera);
  EXPECT_EQ(camera->fx, 400);
  EXPECT_EQ(camera->cy, 230);
  EXPECT_EQ(camera->distortion, DistortionModel::kNone);
}

TEST(RosCamera, FollowsBinningAndRegion) {
  CameraInfo cut = info("plumb_bob", {});
  cut.binning_x = cut.binning_y = 2;
  cut.roi = {100, 40, 400, 500, false};
  const auto camera = cameraOf(cut, false);
  ASSERT_TRUE(camera);
  EXPECT_EQ(camera->width, 250u);
  EXPECT_EQ(camera->height, 200u);
  EXPECT_EQ(camera->fx, 250);
  EXPECT_EQ(camera->cx, 110);
  EXPECT_EQ(camera->cy, 100);
}

TEST(RosCamera, WhatIsNotKnownIsSaid) {
  EXPECT_THAT(cameraOf(CameraInfo(), false).error().detail, HasSubstr("no focal length in K"));
  EXPECT_THAT(cameraOf(info("double_sphere", {1, 2}), false).error().detail,
              HasSubstr("`double_sphere`"));
  const double nan = std::nan("");
  EXPECT_THAT(cameraOf(info("plumb_bob", {0.1, nan, 0, 0, 0}), false).error().detail,
              HasSubstr("D[1] is nan"));
  CameraInfo off = info("plumb_bob", {});
  off.k[2] = -INFINITY;
  EXPECT_THAT(cameraOf(off, false).error().detail, HasSubstr("K[2] is -inf"));
  EXPECT_TRUE(cameraOf(off, true)) << "of rectified images K says nothing";
}

TransformStamped edge(const std::string& parent, const std::string& child, double x,
                      double yaw = 0.0) {
  TransformStamped one;
  one.header.frame_id = parent;
  one.child_frame_id = child;
  one.transform.translation.x = x;
  one.transform.rotation = {0, 0, std::sin(yaw / 2), std::cos(yaw / 2)};
  return one;
}

TEST(FrameTree, FindsTheWayUpAndDown) {
  FrameTree tree;
  tree.add({{edge("base_link", "imu", 1.0, M_PI / 2), edge("/base_link", "/mount", 3.0)}});
  tree.add({{edge("mount", "camera", 0.5)}});
  const auto T = tree.find("imu", "camera");
  ASSERT_TRUE(T);
  EXPECT_LT((T->p - Eigen::Vector3d(0, -2.5, 0)).norm(), 1e-12);
  EXPECT_LT(
      (tree.find("camera", "imu")->matrix() * T->matrix() - Eigen::Matrix4d::Identity()).norm(),
      1e-12);
  EXPECT_EQ(tree.find("camera", "camera")->p.norm(), 0);
  EXPECT_FALSE(tree.find("imu", "lidar"));
}

TEST(FrameTree, GoesRoundNoCircleAndTakesNoRotationThatIsNone) {
  FrameTree tree;
  TransformStamped none = edge("a", "c", 1.0);
  none.transform.rotation = {0, 0, 0, 0};
  tree.add({{edge("a", "b", 1.0), edge("b", "a", 1.0), none}});
  EXPECT_TRUE(tree.find("a", "b"));
  EXPECT_FALSE(tree.find("a", "c"));
  EXPECT_THAT(tree.refused().at("c"), HasSubstr("from `a` to `c` is none"));
}

}  // namespace
}  // namespace perdure::ros
