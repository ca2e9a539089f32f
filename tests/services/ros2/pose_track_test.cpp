#include "services/ros2/core/pose_track.h"

#include <gtest/gtest.h>

#include "common/ros/objects.h"

namespace perdure::ros2 {
namespace {

TimePoint at(double seconds) { return TimePoint(durationFromSeconds(seconds)); }

ros::Odometry odometryAt(double x) {
  ros::Odometry m;
  m.pose.pose.position.x = x;
  m.twist.twist.linear.x = 10;
  return m;
}

PoseTrack track() { return PoseTrack({}, {7, 0}); }

TEST(Ros2PoseTrack, TellsAFrameWhatLiesBetweenTwoMessages) {
  PoseTrack poses = track();
  ASSERT_TRUE(poses.onFrame({1, 4, at(10.05), 0}));
  ASSERT_TRUE(poses.onOdometry(odometryAt(0), at(10.0), {}));
  EXPECT_TRUE(poses.take().empty()) << "what comes next may be nearer";
  ASSERT_TRUE(poses.onOdometry(odometryAt(1), at(10.1), {}));
  const auto told = poses.take();
  ASSERT_EQ(told.size(), 1u);
  EXPECT_EQ(told[0].stamp.sequence, 4u);
  EXPECT_NEAR(told[0].T_WB.p.x(), 0.5, 1e-12);
  EXPECT_EQ(told[0].world, (WorldId{7, 0}));
  EXPECT_EQ(told[0].state, OdometryState::kTracking);
  EXPECT_TRUE(poses.take().empty());
}

TEST(Ros2PoseTrack, IsTheInverseOfWhatTheMirrorWrites) {
  Odometry pose;
  pose.T_WB = {Eigen::Quaterniond(0.8, 0.2, -0.4, std::sqrt(1 - 0.84)), Eigen::Vector3d(1, 2, 3)};
  pose.v_WB = {4, 5, 6};
  Matrix9d a = Matrix9d::Random();
  pose.covariance = a * a.transpose();
  PoseTrack poses = track();
  ASSERT_TRUE(poses.onFrame({1, 4, at(10.0), 0}));
  const auto taken = poses.onOdometry(ros::odometryOf(pose, std::nullopt), at(10.0), {});
  ASSERT_TRUE(taken) << taken.error().code;
  const Odometry back = poses.take().at(0);
  EXPECT_LT((back.T_WB.matrix() - pose.T_WB.matrix()).norm(), 1e-12);
  EXPECT_LT((back.v_WB - pose.v_WB).norm(), 1e-12);
  const Matrix6d off =
      back.covariance.topLeftCorner<6, 6>() - pose.covariance.topLeftCorner<6, 6>();
  EXPECT_LT(off.norm(), 1e-9);
}

/// The pose of another point of a rigid body: the covariance by the Jacobian, compared with known
/// values for a lever of 3 m.
TEST(Ros2PoseTrack, CarriesTheCovarianceToTheBody) {
  ros::Odometry m = odometryAt(0);
  m.pose.pose.orientation = {0, 0, std::sqrt(0.5), std::sqrt(0.5)};
  const double sigma = 0.02;
  m.pose.covariance[35] = sigma * sigma;  // about z, in W
  const RigidTransform T_child_body(Eigen::Quaterniond::Identity(), Eigen::Vector3d(3, 0, 0));
  PoseTrack poses = track();
  ASSERT_TRUE(poses.onFrame({1, 4, at(10.0), 0}));
  ASSERT_TRUE(poses.onOdometry(m, at(10.0), T_child_body));
  const Odometry told = poses.take().at(0);
  EXPECT_NEAR(told.T_WB.p.y(), 3, 1e-12);
  EXPECT_NEAR(told.covariance(3, 3), 9 * sigma * sigma, 1e-9) << "across, by the lever";
  EXPECT_NEAR(told.covariance(4, 4), 0, 1e-9) << "along";
  EXPECT_NEAR(told.covariance(2, 2), sigma * sigma, 1e-9);
}

TEST(Ros2PoseTrack, RefusesWhatIsNoPose) {
  PoseTrack poses = track();
  ros::Odometry m = odometryAt(0);
  m.pose.pose.position.y = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(poses.onOdometry(m, at(1), {}).error().code, "not_finite");
  m = odometryAt(0);
  m.pose.pose.orientation.w = 0;
  EXPECT_EQ(poses.onOdometry(m, at(1), {}).error().code, "no_rotation");
  m = odometryAt(0);
  m.pose.covariance[0] = 1, m.pose.covariance[7] = 1;
  m.pose.covariance[1] = m.pose.covariance[6] = 5;
  EXPECT_EQ(poses.onOdometry(m, at(1), {}).error().code, "covariance");
  m.pose.covariance[0] = std::numeric_limits<double>::infinity();
  EXPECT_EQ(poses.onOdometry(m, at(1), {}).error().code, "covariance");
}

TEST(Ros2PoseTrack, TakesItsOwnSigmasWhereTheMessageHasNone) {
  PoseTrack poses({0.5, 0.25, 3.0}, {7, 0});
  ASSERT_TRUE(poses.onFrame({1, 4, at(10.0), 0}));
  ASSERT_TRUE(poses.onOdometry(odometryAt(0), at(10.0), {}));
  const Odometry told = poses.take().at(0);
  EXPECT_NEAR(told.covariance(0, 0), 0.0625, 1e-9);
  EXPECT_NEAR(told.covariance(3, 3), 0.25, 1e-9);
}

/// A robot in the plane has no estimate of z, roll and pitch.
TEST(Ros2PoseTrack, TakesItsOwnSigmasForAxesWithUnknownVariances) {
  PoseTrack poses({0.5, 0.25, 3.0}, {7, 0});
  ros::Odometry m = odometryAt(0);
  m.pose.covariance[0] = m.pose.covariance[7] = 0.01;
  m.pose.covariance[1] = m.pose.covariance[6] = 0.005;
  for (const std::size_t axis : {2, 3, 4}) m.pose.covariance[7 * axis] = 1e9;
  m.pose.covariance[5 * 7] = 0.0004;
  ASSERT_TRUE(poses.onFrame({1, 4, at(10.0), 0}));
  ASSERT_TRUE(poses.onOdometry(m, at(10.0), {}));
  const Odometry told = poses.take().at(0);
  EXPECT_NEAR(told.covariance(3, 3), 0.01, 1e-9);
  EXPECT_NEAR(told.covariance(3, 4), 0.005, 1e-9);
  EXPECT_NEAR(told.covariance(5, 5), 0.25, 1e-9);
  EXPECT_NEAR(told.covariance(0, 0), 0.0625, 1e-9);
  EXPECT_NEAR(told.covariance(2, 2), 0.0004, 1e-9);
}

TEST(Ros2PoseTrack, AJumpBeginsANewEpochAndNoFrameIsPutAcrossIt) {
  PoseTrack poses = track();
  ASSERT_TRUE(poses.onFrame({1, 4, at(10.05), 0}));
  ASSERT_TRUE(poses.onFrame({1, 5, at(10.1), 0}));
  ASSERT_TRUE(poses.onOdometry(odometryAt(0), at(10.0), {}));
  EXPECT_EQ(poses.onOdometry(odometryAt(40), at(10.1), {}).error().code, "jumped");
  const auto told = poses.take();
  ASSERT_EQ(told.size(), 1u);
  EXPECT_EQ(told[0].stamp.sequence, 5u);
  EXPECT_EQ(told[0].world, (WorldId{7, 1}));
  EXPECT_EQ(poses.untold(), 1u);
  ASSERT_TRUE(poses.onFrame({1, 6, at(5.0), 0}));
  ASSERT_TRUE(poses.onOdometry(odometryAt(41), at(5.0), {})) << "a driver that began again";
  EXPECT_EQ(poses.take().at(0).world, (WorldId{7, 2}));
}

TEST(Ros2PoseTrack, FramesInAGapOrBeforeTheFirstMessageHaveNoPoseAndNoneWaitForEver) {
  PoseTrack poses = track();
  ASSERT_TRUE(poses.onFrame({1, 1, at(9.0), 0}));
  ASSERT_TRUE(poses.onFrame({1, 2, at(10.5), 0}));
  ASSERT_TRUE(poses.onOdometry(odometryAt(0), at(10.0), {}));
  ASSERT_TRUE(poses.onOdometry(odometryAt(10), at(11.0), {}));
  EXPECT_TRUE(poses.take().empty());
  EXPECT_EQ(poses.untold(), 2u);
  for (int i = 0; i < 64; ++i) ASSERT_TRUE(poses.onFrame({1, 3, at(12.0), 0}));
  EXPECT_EQ(poses.onFrame({1, 3, at(12.0), 0}).error().code, "late");
}

}  // namespace
}  // namespace perdure::ros2
