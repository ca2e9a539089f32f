// The pose of W in M and its covariance, compared with drawn errors.
#include <gtest/gtest.h>

#include <random>

#include "common/mapping/mapper.h"
#include "common/math/gaussian.h"
#include "common/math/so3.h"

namespace perdure::mapping {
namespace {

constexpr double kWalkPosition = 0.05, kWalkYaw = 0.004;  // m/√m, rad/√m

/// Two streets that meet at an angle, one metre per step, in a W that is rotated.
LevelPose stepOf(int i) { return {{1.0, 0.0, 0.0}, i == 60 ? 1.4 : 0.0}; }

const LevelPose kBegin{{30.0, -20.0, 2.0}, 2.3};
constexpr int kSteps = 132;

Odometry at(int i, const LevelPose& T_WB, const WorldId& world = {3, 1}) {
  Odometry o;
  o.stamp.sequence = static_cast<std::uint64_t>(i);
  o.world = world;
  o.state = OdometryState::kTracking;
  o.T_WB = T_WB.rigid();
  return o;
}

Parameters walking() {
  Parameters parameters;
  parameters.anchor.walk_position = kWalkPosition;
  parameters.anchor.walk_yaw = kWalkYaw;
  return parameters;
}

TEST(MapFrame, IsNothingBeforeTheFirstPose) {
  Mapper mapper{{}};
  EXPECT_FALSE(mapper.frame());
}

TEST(MapFrame, OfTheFirstSessionIsItsOwn) {
  Mapper mapper(walking());
  LevelPose T_WB = kBegin;
  mapper.onOdometry(at(0, T_WB));
  const auto frame = mapper.frame();
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->map, (WorldId{3, 1}));
  EXPECT_LT(frame->T_MW.p.norm(), 1e-9);
  EXPECT_LT(std::abs(yawOf(frame->T_MW.R())), 1e-9);
  EXPECT_EQ(frame->covariance.norm(), 0.0) << "its first anchor is exact";
  EXPECT_EQ(frame->sessions, 1u);
  EXPECT_EQ(frame->loops, 0u);
}

TEST(MapFrame, ItsCovarianceIsThatOfDrawnErrors) {
  Mapper mapper(walking());
  LevelPose T_WB = kBegin;
  mapper.onOdometry(at(0, T_WB));
  int end = 0;
  LevelPose nominal;
  for (int i = 1; i <= kSteps; ++i) {
    T_WB = T_WB * stepOf(i);
    const std::size_t before = mapper.anchors().size();
    mapper.onOdometry(at(i, T_WB));
    if (mapper.anchors().size() > before) end = i, nominal = T_WB;
  }
  ASSERT_GT(end, 120);
  const Eigen::Matrix4d told = mapper.frame()->covariance;

  std::mt19937 random(8);
  std::normal_distribution<double> normal;
  Eigen::Matrix4d drawn = Eigen::Matrix4d::Zero();
  double nees = 0.0;
  constexpr int kRuns = 4000;
  for (int run = 0; run < kRuns; ++run) {
    LevelPose T = kBegin;
    for (int i = 1; i <= end; ++i) {
      LevelPose step = stepOf(i);
      step.p += kWalkPosition * Eigen::Vector3d(normal(random), normal(random), normal(random));
      step.yaw += kWalkYaw * normal(random);
      T = T * step;
    }
    const LevelError error = difference(T, nominal);
    drawn += error * error.transpose() / kRuns;
    nees += squaredMahalanobis(error, told) / kRuns;
  }
  // The covariance is far from isotropic, so the test depends on its direction.
  EXPECT_GT(eigenvalues(told.topLeftCorner<2, 2>()).maxCoeff(),
            3.0 * eigenvalues(told.topLeftCorner<2, 2>()).minCoeff());
  EXPECT_NEAR(nees, 4.0, 0.3) << "told\n" << told << "\ndrawn\n" << drawn;
  for (int k = 0; k < 4; ++k) EXPECT_NEAR(drawn(k, k), told(k, k), 0.12 * told(k, k)) << k;
  EXPECT_NEAR(drawn(0, 1), told(0, 1), 0.12 * std::sqrt(told(0, 0) * told(1, 1)));
}

TEST(MapFrame, ASessionThatBelongsToNothingHasAFrameOfItsOwn) {
  Mapper mapper(walking());
  mapper.onOdometry(at(0, kBegin));
  mapper.onOdometry(at(1, {}, {4, 1}));
  const auto frame = mapper.frame();
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->map, (WorldId{4, 1}));
  EXPECT_EQ(frame->sessions, 1u);
  EXPECT_TRUE(mapper.follows({4, 1}));
  EXPECT_FALSE(mapper.follows({3, 1}));
}

/// The first session is that of a tilted vehicle, so its W is tilted too.
TEST(MapFrame, IsLevelWhereWLeans) {
  Mapper mapper{{}};
  Odometry o = at(0, {});
  const Eigen::Quaterniond lean = expQuaternion({0.2, -0.1, 0.0});
  o.up_W = lean * Eigen::Vector3d::UnitZ();
  mapper.onOdometry(o);
  o.stamp.sequence = 1;
  o.T_WB.p = lean * Eigen::Vector3d(20.0, 0.0, 0.0);
  mapper.onOdometry(o);
  const RigidTransform T_MW = mapper.frame()->T_MW;
  EXPECT_LT((T_MW.R() * o.up_W - Eigen::Vector3d::UnitZ()).norm(), 1e-9);
  EXPECT_NEAR((T_MW * o.T_WB.p).z(), T_MW.p.z(), 1e-9) << "a level way is level in M";
}

}  // namespace
}  // namespace perdure::mapping
