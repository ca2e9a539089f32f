#include "common/sim/trajectory.h"

#include <gtest/gtest.h>

#include <random>

#include "common/math/so3.h"

namespace perdure::sim {
namespace {

std::vector<RigidTransform> wildControls(std::uint64_t seed, std::size_t count) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::vector<RigidTransform> controls;
  RigidTransform T;
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector3d turn(normal(random), normal(random), normal(random));
    const Eigen::Vector3d step(normal(random), normal(random), normal(random));
    T = RigidTransform(T.q * expQuaternion(0.4 * turn), T.p + step);
    controls.push_back(T);
  }
  return controls;
}

TEST(Trajectory, HasTheDerivativesThatDifferencesShow) {
  const Trajectory trajectory(2.0, 0.3, wildControls(1, 20));
  const double h = 1e-5;
  for (double t = 1.0; t < 9.0; t += 0.037) {
    const MotionState before = trajectory.at(t - h), now = trajectory.at(t),
                      after = trajectory.at(t + h);
    const Eigen::Vector3d velocity = (after.T_WB.p - before.T_WB.p) / (2 * h);
    EXPECT_LT((velocity - now.velocity_W).norm(), 1e-6) << t;
    const Eigen::Vector3d acceleration = (after.velocity_W - before.velocity_W) / (2 * h);
    EXPECT_LT((acceleration - now.acceleration_W).norm(), 1e-5) << t;
    const Eigen::Vector3d rate = logSo3(before.T_WB.q.conjugate() * after.T_WB.q) / (2 * h);
    EXPECT_LT((rate - now.angular_velocity_B).norm(), 1e-6) << t;
    const Eigen::Vector3d angular =
        (after.angular_velocity_B - before.angular_velocity_B) / (2 * h);
    EXPECT_LT((angular - now.angular_acceleration_B).norm(), 1e-5) << t;
  }
}

TEST(Trajectory, IsContinuousUpToTheRateOfItsAccelerations) {
  const Trajectory trajectory(0.0, 0.5, wildControls(2, 12));
  const double h = 1e-7;
  for (int i = -6; i < 30; ++i) {
    const double knot = 0.25 * i;  // knots of the position's spline and, half-way, of the
                                   // rotation's
    const MotionState before = trajectory.at(knot - h), after = trajectory.at(knot + h);
    EXPECT_LT((after.velocity_W - before.velocity_W).norm(), 1e-5);
    EXPECT_LT((after.acceleration_W - before.acceleration_W).norm(), 1e-4);
    EXPECT_LT((after.angular_velocity_B - before.angular_velocity_B).norm(), 1e-5);
    EXPECT_LT((after.angular_acceleration_B - before.angular_acceleration_B).norm(), 1e-4);
  }
}

TEST(Trajectory, FollowsControlsOnAStraightWayExactly) {
  std::vector<RigidTransform> controls;
  for (int i = 0; i < 20; ++i) {
    controls.emplace_back(expQuaternion({0, 0, 0.1 * i}), Eigen::Vector3d(2.0 * i, 5, 1));
  }
  const Trajectory trajectory(10.0, 0.5, controls);
  for (double t = 12.0; t < 17.0; t += 0.11) {
    const MotionState state = trajectory.at(t);
    EXPECT_NEAR(state.T_WB.p.x(), 4.0 * (t - 10.0), 1e-12);
    EXPECT_NEAR(yawOf(state.T_WB.R()), 0.2 * (t - 10.0), 1e-12);
    EXPECT_NEAR(state.velocity_W.x(), 4.0, 1e-12);
    EXPECT_NEAR(state.angular_velocity_B.z(), 0.2, 1e-12);
    EXPECT_LT(state.acceleration_W.norm() + state.angular_acceleration_B.norm(), 1e-10);
  }
}

TEST(Trajectory, RestsBeforeAndAfterItsControls) {
  const auto controls = wildControls(3, 6);
  const Trajectory trajectory(0.0, 0.2, controls);
  for (const double t : {-1e300, -0.61, 1.61, 1e300}) {
    const MotionState state = trajectory.at(t);
    const RigidTransform& end = t < 0 ? controls.front() : controls.back();
    EXPECT_LT(boxMinus(state.T_WB, end).norm(), 1e-12);
    EXPECT_EQ(state.velocity_W.norm() + state.angular_velocity_B.norm(), 0.0);
    EXPECT_LT(state.acceleration_W.norm() + state.angular_acceleration_B.norm(), 1e-12);
  }
}

TEST(Trajectory, OfOnePoseNeverMoves) {
  const RigidTransform T(expQuaternion({0.1, 0.2, 0.3}), Eigen::Vector3d(1, 2, 3));
  const MotionState state = Trajectory(T).at(123.4);
  EXPECT_EQ(boxMinus(state.T_WB, T).norm(), 0.0);
  EXPECT_EQ(state.velocity_W.norm() + state.acceleration_W.norm(), 0.0);
}

}  // namespace
}  // namespace perdure::sim
