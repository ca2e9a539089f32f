#include "common/camera/ground_view.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

namespace perdure {
namespace {

using Cells = std::set<std::pair<int, int>>;

/// A camera that looks along x of the body.
CameraModel forward() {
  CameraCalibration c;
  c.width = 1242, c.height = 375;
  c.fx = c.fy = 720.0;
  c.cx = 620.0, c.cy = 180.0;
  Eigen::Matrix3d R;
  R << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  c.T_BC = RigidTransform(R, Eigen::Vector3d::Zero());
  return CameraModel(c);
}

Cells inView(double yaw) {
  const CameraModel camera = forward();
  const Eigen::Quaterniond q(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()));
  Cells cells;
  forGroundInView(camera, {q, Eigen::Vector3d(0.5, 0.5, 1.2)}, {1.0, 20.0, 0.0},
                  [&](int i, int j) { EXPECT_TRUE(cells.emplace(i, j).second); });
  return cells;
}

TEST(GroundView, ACameraOfALevelBodyLooksAlongTheGroundOrUp) {
  CameraCalibration upright_phone = forward().calibration();
  upright_phone.T_BC = RigidTransform();  // the optical axis is the body's z axis
  EXPECT_TRUE(looksAlongGround(forward()));
  EXPECT_FALSE(looksAlongGround(CameraModel(upright_phone)));
}

TEST(GroundView, IsTheGroundAheadWithinReach) {
  const Cells cells = inView(0.0);
  EXPECT_TRUE(cells.contains({15, 0}));
  EXPECT_FALSE(cells.contains({-15, 0})) << "behind";
  EXPECT_FALSE(cells.contains({2, 0})) << "below the image";
  EXPECT_FALSE(cells.contains({21, 0})) << "beyond the reach";
  EXPECT_FALSE(cells.contains({5, 15})) << "beside the image";
}

TEST(GroundView, TurnsWithTheBody) {
  const Cells ahead = inView(0.0), left = inView(M_PI / 2.0);
  ASSERT_GT(ahead.size(), 50u);
  for (const auto& [i, j] : ahead) EXPECT_TRUE(left.contains({-j, i})) << i << " " << j;
}

}  // namespace
}  // namespace perdure
