#include "common/replay/level_planes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

namespace perdure::replay {
namespace {

using ::testing::HasSubstr;

constexpr double kDegree = std::numbers::pi / 180.0;

CameraCalibration depthCamera() {
  CameraCalibration camera;
  camera.width = 640, camera.height = 480;
  camera.fx = camera.fy = 585.0, camera.cx = 320.0, camera.cy = 240.0;
  return camera;
}

/// The plane n · x = d.
struct Plane {
  Eigen::Vector3d n;
  double d;
};

/// Renders the depth of the nearest plane at each pixel, with the noise of structured light.
cv::Mat depthOf(const std::vector<Plane>& planes, const Eigen::Matrix3d& R,
                const Eigen::Vector3d& p, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0.0, 1.4e-3);
  cv::Mat depth(480, 640, CV_16UC1, cv::Scalar(0));
  for (int r = 0; r < depth.rows; ++r) {
    for (int c = 0; c < depth.cols; ++c) {
      const Eigen::Vector3d ray = R * Eigen::Vector3d((c - 320) / 585.0, (r - 240) / 585.0, 1.0);
      double z = std::numeric_limits<double>::max();
      for (const Plane& plane : planes) {
        const double at = (plane.d - plane.n.dot(p)) / plane.n.dot(ray);
        if (at > 0.3) z = std::min(z, at);
      }
      if (z > 8.0) continue;
      z += noise(random) * z * z;
      depth.at<std::uint16_t>(r, c) = static_cast<std::uint16_t>(std::lround(1000.0 * z));
    }
  }
  return depth;
}

/// Rotation of a camera that looks along x in a world with z up, pitched down and rolled.
Eigen::Matrix3d lookingDown(double pitch_deg, double roll_deg) {
  Eigen::Matrix3d R_BC;
  R_BC << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  return Eigen::AngleAxisd(pitch_deg * kDegree, Eigen::Vector3d::UnitY()) *
         Eigen::AngleAxisd(roll_deg * kDegree, Eigen::Vector3d::UnitX()) * R_BC;
}

const Plane kFloor{Eigen::Vector3d::UnitZ(), 0.0}, kWall{Eigen::Vector3d::UnitX(), 3.0};

double angleDeg(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::acos(std::min(1.0, a.normalized().dot(b.normalized()))) / kDegree;
}

TEST(LevelPlanes, TheFloorTellsUpThoughTheCameraLooksDownAndIsRolled) {
  for (const double pitch : {10.0, 25.0, 40.0}) {
    for (const double roll : {-15.0, 0.0, 15.0}) {
      // The poses may have any frame; this one is rotated about all axes.
      const Eigen::Matrix3d R_PW =
          Eigen::AngleAxisd(2.0, Eigen::Vector3d(1, -2, 0.5).normalized()).toRotationMatrix();
      LevelPlanes planes;
      Eigen::Vector3d about = Eigen::Vector3d::Zero();
      for (std::uint32_t view = 0; view < 3; ++view) {
        const Eigen::Matrix3d R = lookingDown(pitch + view, roll);
        planes.add(depthOf({kFloor, kWall}, R, {0.1 * view, 0, 1.4}, view), depthCamera(),
                   R_PW * R);
        about -= R_PW * R.col(1);
      }
      const auto up = planes.up(about);
      ASSERT_TRUE(up) << pitch << ' ' << roll << ": " << up.error().detail;
      EXPECT_LT(angleDeg(up->up, R_PW.col(2)), 0.5) << pitch << ' ' << roll;
      EXPECT_GT(up->patches, 200U);
    }
  }
}

TEST(LevelPlanes, AWallAloneTellsNothing) {
  LevelPlanes planes;
  const Eigen::Matrix3d R = lookingDown(0.0, 0.0);
  planes.add(depthOf({kWall}, R, {0, 0, 1.4}, 1), depthCamera(), R);
  const auto up = planes.up(Eigen::Vector3d::UnitZ());
  ASSERT_FALSE(up);
  EXPECT_EQ(up.error().code, "planes_none");
}

TEST(LevelPlanes, TwoSlopesThatAreSeenAsMuchAreRefused) {
  const auto slope = [](double y) { return Eigen::Vector3d(0.0, y, 1.0).normalized(); };
  LevelPlanes planes;
  const Eigen::Matrix3d R = lookingDown(35.0, 0.0);
  const Plane left{slope(0.5), 0.0}, right{slope(-0.5), 0.0};
  planes.add(depthOf({left, right}, R, {0, 0, 1.4}, 1), depthCamera(), R);
  const auto up = planes.up(Eigen::Vector3d::UnitZ());
  ASSERT_FALSE(up);
  EXPECT_EQ(up.error().code, "planes_ambiguous");
  EXPECT_THAT(up.error().detail, HasSubstr("two planes may be level"));
}

TEST(LevelPlanes, NoDepthIsNoPlane) {
  LevelPlanes planes;
  planes.add(cv::Mat(480, 640, CV_16UC1, cv::Scalar(0)), depthCamera(),
             Eigen::Matrix3d::Identity());
  planes.add(cv::Mat(480, 640, CV_16UC1, cv::Scalar(65535)), depthCamera(),
             Eigen::Matrix3d::Identity());
  EXPECT_FALSE(planes.up(Eigen::Vector3d::UnitZ()));
}

}  // namespace
}  // namespace perdure::replay
