#include "services/ros2/core/rig.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

namespace perdure::ros2 {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

ros::CameraInfo info() {
  ros::CameraInfo m;
  m.header.frame_id = "eye";
  m.width = 64, m.height = 48;
  m.distortion_model = "plumb_bob";
  m.d = {0, 0, 0, 0, 0};
  m.k = {50, 0, 32, 0, 50, 24, 0, 0, 1};
  return m;
}
ros::TFMessage way(const std::string& parent, const std::string& child, double x) {
  ros::TransformStamped t;
  t.header.frame_id = parent, t.child_frame_id = child;
  t.transform.translation.x = x;
  return {{t}};
}
void seeImages(Rig& rig) {
  for (int i = 0; i < 6; ++i) rig.onImageOf(0, "eye", fromNanoseconds(i * 100'000'000LL));
}
Rig rigWith(bool imu, bool odometry, std::string body = {}, Calibration given = {}) {
  return Rig({{"cam0", "/camera/camera_info"}}, std::move(given), imu, odometry, std::move(body));
}

TEST(Ros2Rig, IsKnownWhenLensPlaceAndRateAre) {
  Rig rig = rigWith(true, false);
  EXPECT_THAT(rig.missing(), HasSubstr("waits for inertial samples"));
  rig.onImuOf("/imu");
  EXPECT_THAT(rig.missing(), HasSubstr("waits for a CameraInfo of cam0 on /camera/camera_info"));
  ASSERT_TRUE(rig.onInfo(0, info()));
  EXPECT_THAT(rig.missing(), HasSubstr("where cam0 (frame `eye`) is on the body (frame `imu`)"));
  rig.onTransforms(way("base_link", "imu", 1));
  rig.onTransforms(way("base_link", "eye", 3));
  EXPECT_FALSE(rig.news());
  EXPECT_THAT(rig.missing(), HasSubstr("waits for images of cam0"));
  seeImages(rig);
  const auto all = rig.news();
  ASSERT_TRUE(all);
  EXPECT_EQ(all->cameras[0].T_BC.p.x(), 2);
  EXPECT_NEAR(all->cameras[0].rate_hz, 10, 1e-9);
  EXPECT_THAT(rig.missing(), IsEmpty());
  EXPECT_FALSE(rig.news()) << "told once";
  ASSERT_TRUE(rig.onInfo(0, info()));
  EXPECT_FALSE(rig.news());
  ros::CameraInfo other = info();
  other.k[0] = 60;
  ASSERT_TRUE(rig.onInfo(0, other));
  EXPECT_EQ(rig.news()->cameras[0].fx, 60) << "calibrated anew while it runs";
}

TEST(Ros2Rig, TheBodyIsTheOdometrysChildWithoutAnImuAndTheCameraWithoutBoth) {
  Rig with = rigWith(false, true);
  with.onOdometryOf("base_link");
  with.onTransforms(way("base_link", "eye", 3));
  ASSERT_TRUE(with.onInfo(0, info()));
  seeImages(with);
  EXPECT_EQ(with.news()->cameras[0].T_BC.p.x(), 3);
  EXPECT_EQ(with.bodyIn("base_link")->p.x(), 0);
  EXPECT_EQ(with.bodyIn("eye")->p.x(), -3);
  EXPECT_FALSE(with.bodyIn("elsewhere"));
  Rig without = rigWith(false, false);
  ASSERT_TRUE(without.onInfo(0, info()));
  seeImages(without);
  EXPECT_EQ(without.news()->cameras[0].T_BC.p.norm(), 0);
}

TEST(Ros2Rig, AFileGoesBeforeWhatDriversSay) {
  Calibration given;
  given.cameras.resize(1);
  given.cameras[0].name = "cam0", given.cameras[0].fx = 99;
  given.imu = ImuCalibration{0.1, 0.2, 0.3, 0.4, 200};
  Rig rig = rigWith(true, false, "", given);
  rig.onImuOf("imu");
  seeImages(rig);
  const auto all = rig.news();
  ASSERT_TRUE(all);
  EXPECT_EQ(all->cameras[0].fx, 99);
  EXPECT_EQ(all->imu->gyro_noise, 0.1);
}

TEST(Ros2Rig, RefusesInfosOfNoCalibration) {
  Rig rig = rigWith(false, false);
  ros::CameraInfo none = info();
  none.k = {};
  EXPECT_EQ(rig.onInfo(0, none).error().code, "uncalibrated");
  ros::CameraInfo nan = info();
  nan.k[2] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(rig.onInfo(0, nan).error().code, "not_finite");
  ros::CameraInfo odd = info();
  odd.distortion_model = "thin_prism", odd.d = {1, 2, 3};
  EXPECT_EQ(rig.onInfo(0, odd).error().code, "lens");
}

}  // namespace
}  // namespace perdure::ros2
