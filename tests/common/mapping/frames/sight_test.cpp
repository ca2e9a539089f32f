#include "common/mapping/frames/sight.h"

#include <gtest/gtest.h>

#include <numbers>

#include "common/mapping/frames/level_pose.h"
#include "common/math/so3.h"
#include "tests/support/camera.h"

namespace perdure::mapping {
namespace {

constexpr double kPi = std::numbers::pi;

Calibration withCamera(const Eigen::Matrix3d& R_BC) {
  Calibration calibration;
  calibration.cameras = {tests::cameraAhead(640, 480, 320.0)};
  calibration.cameras[0].T_BC.q = Eigen::Quaterniond(R_BC);
  return calibration;
}

TEST(Sight, IsTheHorizontalFieldOfViewInTheAxesOfTheAnchor) {
  const auto ahead = sightsOf(withCamera(tests::lookingAhead()), {}, Eigen::Vector3d::UnitZ());
  ASSERT_EQ(ahead.size(), 1u);
  EXPECT_NEAR(ahead[0].azimuth, 0.0, 0.01);
  EXPECT_NEAR(ahead[0].half_width, kPi / 4, 0.01) << "320 pixels at a focal length of 320";
  const auto left = sightsOf(withCamera(rotationAboutZ(kPi / 2) * tests::lookingAhead()), {},
                             Eigen::Vector3d::UnitZ());
  EXPECT_NEAR(left[0].azimuth, kPi / 2, 0.01);
}

TEST(Sight, IsTheSameHoweverTheImuIsMounted) {
  const Eigen::Matrix3d R_WC = rotationAboutZ(0.7) * tests::lookingAhead();
  const Eigen::Vector3d up_W = Eigen::Vector3d::UnitZ();
  for (const Eigen::Vector3d& turn :
       {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(0, 1.2, 0), Eigen::Vector3d(1.5, 0.3, -2.0)}) {
    const RigidTransform T_WB(expSo3(turn), Eigen::Vector3d(1, 2, 3));
    const auto sights = sightsOf(withCamera(T_WB.R().transpose() * R_WC), T_WB, up_W);
    ASSERT_EQ(sights.size(), 1u);
    const double yaw = levelOf(levelled(T_WB, up_W)).yaw;
    EXPECT_NEAR(wrapAngle(yaw + sights[0].azimuth - 0.7), 0.0, 0.01);
    EXPECT_NEAR(sights[0].half_width, kPi / 4, 0.01);
  }
}

TEST(Sight, IsReadAsItWasWritten) {
  const std::vector<Sight> sights{{0.25, 0.5}, {-2.0, 1.0}};
  EXPECT_EQ(sightsFrom(toText(sights)), sights);
  EXPECT_TRUE(sightsFrom("").empty());
  EXPECT_TRUE(sightsFrom("1.0 0.0").empty()) << "a camera that sees nothing";
  EXPECT_EQ(sightsFrom("0.25 0.5 x").size(), 1u);
}

}  // namespace
}  // namespace perdure::mapping
