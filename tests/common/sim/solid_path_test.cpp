#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "common/math/so3.h"
#include "common/sim/path.h"
#include "common/sim/solid.h"

namespace perdure::sim {
namespace {

Solid box(double x, double y, double yaw, double low = 0.0) {
  return {{x, y}, yaw, {2.0, 1.0}, low, low + 1.5};
}

TEST(Solid, MeetsWhatItReachesIntoAndNothingElse) {
  EXPECT_TRUE(meet(box(0, 0, 0), box(3.9, 0, 0)));
  EXPECT_FALSE(meet(box(0, 0, 0), box(4.1, 0, 0)));
  EXPECT_TRUE(meet(box(0, 0, 0), box(4.1, 0, 0), 0.2));
  EXPECT_FALSE(meet(box(0, 0, 0), box(0, 2.1, 0)));
  EXPECT_TRUE(meet(box(0, 0, 0), box(0, 2.1, M_PI_2)));
  // The boxes face each other with a corner, so only the rotated axes separate them.
  EXPECT_FALSE(meet(box(0, 0, 0), box(3.2, 2.7, M_PI_4)));
  EXPECT_TRUE(meet(box(0, 0, 0), box(3.0, 2.6, M_PI_4)));
  // One box stands on top of the other.
  EXPECT_FALSE(meet(box(0, 0, 0), box(0, 0, 0.3, 1.5), -1e-9));
  EXPECT_TRUE(meet(box(0, 0, 0), box(0, 0, 0.3, 1.4)));
}

TEST(Solid, KnowsTheDistanceOfAPointAndWhatItHides) {
  const Solid solid = box(1, 2, M_PI_2);
  EXPECT_EQ(distanceTo(solid, {1, 3.9}), 0.0);
  EXPECT_NEAR(distanceTo(solid, {1, 5}), 1.0, 1e-12);
  EXPECT_NEAR(distanceTo(solid, {2 + 3, 4 + 4}), 5.0, 1e-12);
  EXPECT_TRUE(blocks(solid, {-9, 2, 1}, {9, 2, 1}));
  EXPECT_FALSE(blocks(solid, {-9, 2, 2}, {9, 2, 1.6}));
  EXPECT_FALSE(blocks(solid, {-9, 2, 1}, {-1, 2, 1}));
  EXPECT_FALSE(blocks(solid, {-9, 4.5, 1}, {9, 4.5, 1}));
}

TEST(GroundPath, HasCurvatureThatItsHeadingAndPositionsShow) {
  const GroundPath path({{{0, 0}, 6}, {{40, 0}, 6}, {{40, 30}, 6}, {{0, 30}, 6}}, true);
  EXPECT_NEAR(path.length(), 140 - 48 + 2 * M_PI * 6, 3.0);
  const double h = 1.0;
  double most = 0.0;
  for (double s = 0.0; s < 2.0 * path.length(); s += 0.7) {
    const PathPoint before = path.at(s - h), now = path.at(s), after = path.at(s + h);
    const Eigen::Vector2d way = after.position - before.position;
    EXPECT_NEAR(way.norm(), 2 * h, 0.02) << s;
    EXPECT_NEAR(wrapAngle(std::atan2(way.y(), way.x()) - now.heading), 0.0, 0.02) << s;
    EXPECT_NEAR((after.heading - before.heading) / (2 * h), now.curvature, 0.04) << s;
    most = std::max(most, now.curvature);
  }
  EXPECT_NEAR(most, 1.0 / 6.0, 0.03);
  // After one lap, the heading has increased by a full turn and the position is the same.
  const PathPoint first = path.at(13.0), second = path.at(13.0 + path.length());
  EXPECT_LT((first.position - second.position).norm(), 1e-9);
  EXPECT_NEAR(second.heading - first.heading, 2 * M_PI, 1e-9);
}

TEST(GroundPath, GoesOnStraightBeyondItsEnds) {
  const GroundPath path({{{0, 0}}, {{10, 0}}}, false);
  EXPECT_NEAR(path.at(15.0).position.x(), 15.0, 1e-9);
  EXPECT_NEAR(path.at(-5.0).position.x(), -5.0, 1e-9);
}

TEST(Drive, KeepsItsLimitsStandsFirstAndStopsWhereItIsTold) {
  const GroundPath path({{{0, 0}}, {{60, 0}, 8}, {{60, 60}}}, false);
  const SpeedLimits limits{9.0, 2.0, 1.5, 1.8};
  const Drive driven = drive(path, limits, 5.0, 100.0, 2.0, 40.0);
  EXPECT_EQ(driven.distanceAt(1.0), 5.0);
  EXPECT_NEAR(driven.distanceAt(39.0), 100.0, 0.3);
  double top = 0.0;
  for (double t = 0.5; t < 39.0; t += 0.05) {
    const double h = 0.25, before = driven.distanceAt(t - h), now = driven.distanceAt(t);
    const double after = driven.distanceAt(t + h), speed = (after - before) / (2 * h);
    const double accel = (after - 2 * now + before) / (h * h);
    top = std::max(top, speed);
    EXPECT_GE(after, before - 1e-9);
    EXPECT_LT(accel, limits.accelerate + 0.1) << t;
    EXPECT_GT(accel, -limits.brake - 0.1) << t;
    EXPECT_LT(speed * speed * std::abs(path.at(now).curvature), limits.lateral + 0.3) << t;
  }
  EXPECT_GT(top, 7.5);
  EXPECT_LT(top, 9.01);
}

TEST(VehicleMotion, PointsAlongItsWayAndLeansOutwards) {
  const GroundPath path({{{0, 0}}, {{60, 0}, 10}, {{60, 90}}}, false);
  const Drive driven = cruise(0.0, 4.5, 0.0, 30.0);
  Suspension suspension;
  suspension.bounce_m = suspension.sway_rad = 0.0;
  const Trajectory motion = vehicleMotion(path, driven, suspension);
  const MotionState turning = motion.at(12.8);
  const Eigen::Vector3d ahead = turning.T_WB.R().col(0), left = turning.T_WB.R().col(1);
  EXPECT_GT(turning.angular_velocity_B.z(), 0.3);
  EXPECT_GT(turning.velocity_W.normalized().dot(ahead), 0.999);
  EXPECT_GT(left.z(), 0.005);  // in a left turn, the left side rises
  EXPECT_NEAR(turning.T_WB.p.z(), suspension.height, 1e-9);
}

}  // namespace
}  // namespace perdure::sim
