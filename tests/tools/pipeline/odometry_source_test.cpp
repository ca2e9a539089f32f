#include "tools/pipeline/odometry_source.h"

#include <gtest/gtest.h>

#include "common/math/so3.h"

namespace perdure::tools {
namespace {

FrameStamp stampOf(std::uint64_t frame) {
  FrameStamp stamp;
  stamp.source = 1;
  stamp.sequence = frame;
  stamp.time = fromNanoseconds(static_cast<std::int64_t>(frame) * 100'000'000);
  return stamp;
}

TEST(PoseOdometry, SaysWhatAFileOfPosesKnowsAndNoMore) {
  std::vector<replay::StampedPose> poses(2);
  poses[1].T_WB.p = Eigen::Vector3d(1, 0, 0);
  PoseOdometry source(replay::PoseFile(replay::PoseFormat::kKitti, poses), 2, {1, 0});
  ASSERT_TRUE(source.at(stampOf(0)));
  const auto odometry = source.at(stampOf(1));
  ASSERT_TRUE(odometry);
  EXPECT_EQ(odometry->state, OdometryState::kTracking);
  EXPECT_FALSE(odometry->has_increment);
  EXPECT_TRUE(odometry->v_WB.isApprox(Eigen::Vector3d(10, 0, 0)));
  EXPECT_GT(odometry->covariance.diagonal().minCoeff(), 0.0);
  EXPECT_FALSE(source.at(stampOf(2))) << "the file has two lines";
}

TEST(PoseOdometry, UpIsTheMeanOfTheBodysZAxisSoFar) {
  std::vector<replay::StampedPose> poses(3);
  poses[1].T_WB.q = expQuaternion({0.2, 0, 0});
  poses[2].T_WB.q = expQuaternion({-0.2, 0, 0});
  PoseOdometry source(replay::PoseFile(replay::PoseFormat::kKitti, poses), 2, {1, 0});
  EXPECT_TRUE(source.at(stampOf(0))->up_W.isApprox(Eigen::Vector3d::UnitZ()));
  const Eigen::Vector3d tilted = source.at(stampOf(1))->up_W;
  EXPECT_NEAR(std::atan2(-tilted.y(), tilted.z()), 0.1, 1e-9);
  EXPECT_NEAR(source.at(stampOf(2))->up_W.z(), 1.0, 1e-9);
}

TEST(PoseOdometry, TruthHasAnErrorThatStaysInTheWorldAndAWorldWhoseZIsUp) {
  std::vector<replay::StampedPose> poses(2);
  poses[0].T_WB.q = expQuaternion({0.2, 0, 0});
  poses[1].T_WB.q = expQuaternion({0.2, 0, 0}) * expQuaternion({0, 0, 0.3});
  PoseOdometry source(replay::PoseFile(replay::PoseFormat::kKitti, poses), 2, {1, 0},
                      ofExactTruth());
  const auto first = source.at(stampOf(0));
  EXPECT_FALSE(first->has_increment) << "nothing was before it";
  const auto second = source.at(stampOf(1));
  EXPECT_EQ(second->up_W, Eigen::Vector3d(Eigen::Vector3d::UnitZ()));
  ASSERT_TRUE(second->has_increment);
  EXPECT_EQ(second->increment_from, 0U);
  EXPECT_TRUE(second->increment_covariance.isZero());
  // An error of the body's attitude is the same rotation of the world in both frames.
  const Eigen::Vector3d error(1e-4, 2e-4, 3e-4);
  const Eigen::Vector3d then = second->transition.topLeftCorner<3, 3>() * error;
  EXPECT_TRUE((second->T_WB.q * then).isApprox(first->T_WB.q * error, 1e-12));
  EXPECT_LT(second->covariance.diagonal().maxCoeff(), 1e-5);
  EXPECT_GT(second->covariance.diagonal().minCoeff(), 0.0);
}

TEST(PoseOdometry, StepsGiveIncrementsWhoseTransitionIsThatOfTheMotion) {
  std::vector<replay::StampedPose> poses(2);
  poses[0].T_WB = RigidTransform(expQuaternion({0.1, -0.2, 0.5}), Eigen::Vector3d(3, -1, 0.5));
  poses[1].T_WB = RigidTransform(expQuaternion({0.0, 0.1, 0.9}), Eigen::Vector3d(5, 1, 0.4));
  const std::vector<Matrix6d> steps(2, 1e-4 * Matrix6d::Identity());
  PoseOdometry source(replay::PoseFile(replay::PoseFormat::kKitti, poses, steps), 2, {1, 0});
  const auto first = source.at(stampOf(0)), second = source.at(stampOf(1));
  EXPECT_FALSE(first->has_increment) << "nothing was before it";
  ASSERT_TRUE(second->has_increment);
  EXPECT_EQ(second->increment_from, 0U);
  const RigidTransform motion = poses[0].T_WB.inverse() * poses[1].T_WB;
  constexpr double kStep = 1e-6;
  Matrix6d numeric;
  for (int i = 0; i < 6; ++i) {
    const auto moved = [&](double by) {
      const Eigen::Matrix<double, 6, 1> d = by * Matrix6d::Identity().col(i);
      const RigidTransform wrong(poses[0].T_WB.q * expQuaternion(d.head<3>()),
                                 Eigen::Vector3d(poses[0].T_WB.p + d.tail<3>()));
      const RigidTransform after = wrong * motion;
      Eigen::Matrix<double, 6, 1> error;
      error << logSo3(Eigen::Quaterniond(poses[1].T_WB.q.conjugate() * after.q)),
          after.p - poses[1].T_WB.p;
      return error;
    };
    numeric.col(i) = (moved(kStep) - moved(-kStep)) / (2.0 * kStep);
  }
  EXPECT_TRUE(second->transition.isApprox(numeric, 1e-7));
  EXPECT_TRUE(second->increment_covariance.isApprox(steps[1], 1e-6));
  const Matrix6d before = first->covariance.topLeftCorner<6, 6>();
  EXPECT_TRUE((second->covariance.topLeftCorner<6, 6>())
                  .isApprox(numeric * before * numeric.transpose() + steps[1], 1e-6));
}

TEST(PoseOdometry, AStepWithoutErrorIsNotTakenForAnExactPose) {
  const std::vector<replay::StampedPose> poses(2);
  const std::vector<Matrix6d> steps(2, Matrix6d::Zero());
  PoseOdometry source(replay::PoseFile(replay::PoseFormat::kKitti, poses, steps), 2, {1, 0});
  (void)source.at(stampOf(0));
  EXPECT_GT(source.at(stampOf(1))->increment_covariance.diagonal().minCoeff(), 0.0)
      << "the filter would take over the covariance that has grown";
}

}  // namespace
}  // namespace perdure::tools
