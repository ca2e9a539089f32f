#include "common/mapping/frames/level_pose.h"

#include <gtest/gtest.h>

#include <numbers>
#include <random>

#include "common/math/numeric_jacobian.h"
#include "common/math/so3.h"

namespace perdure::mapping {
namespace {

using std::numbers::pi;

LevelPose randomPose(std::mt19937& random) {
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  return {{20.0 * u(random), 20.0 * u(random), 3.0 * u(random)}, pi * u(random)};
}

LevelPose moved(const LevelPose& pose, const Eigen::VectorXd& error) {
  return {pose.p + error.head<3>(), pose.yaw + error[3]};
}

TEST(LevelPose, ComposesAndInvertsAsTheRigidTransformThatItIs) {
  std::mt19937 random(1);
  for (int i = 0; i < 50; ++i) {
    const LevelPose a = randomPose(random), b = randomPose(random);
    EXPECT_TRUE((a * b).rigid().matrix().isApprox((a.rigid() * b.rigid()).matrix(), 1e-12));
    EXPECT_LT(difference(a * a.inverse(), LevelPose{}).norm(), 1e-12);
    const Eigen::Vector3d x = randomPose(random).p;
    EXPECT_LT((a * x - a.rigid() * x).norm(), 1e-12);
    EXPECT_LT(difference(levelOf(a.rigid()), a).norm(), 1e-12);
  }
}

TEST(LevelPose, DifferencesOfYawAreWrapped) {
  const LevelPose a{Eigen::Vector3d::Zero(), pi - 0.01}, b{Eigen::Vector3d::Zero(), -pi + 0.01};
  EXPECT_NEAR(difference(a, b)[3], -0.02, 1e-12);
  EXPECT_NEAR((a * a).yaw, -0.02, 1e-12);
}

TEST(LevelPose, JacobiansMatchNumericOnes) {
  std::mt19937 random(2);
  const Eigen::Vector4d none = Eigen::Vector4d::Zero();
  for (int i = 0; i < 20; ++i) {
    const LevelPose a = randomPose(random), b = randomPose(random);
    const auto by_first = [&](const Eigen::VectorXd& e) -> Eigen::VectorXd {
      return difference(moved(a, e) * b, a * b);
    };
    const auto by_second = [&](const Eigen::VectorXd& e) -> Eigen::VectorXd {
      return difference(a * moved(b, e), a * b);
    };
    const auto by_inverted = [&](const Eigen::VectorXd& e) -> Eigen::VectorXd {
      return difference(moved(a, e).inverse(), a.inverse());
    };
    EXPECT_LT((numericJacobian(by_first, none) - composedByFirst(a, b)).norm(), 1e-7);
    EXPECT_LT((numericJacobian(by_second, none) - composedBySecond(a)).norm(), 1e-7);
    EXPECT_LT((numericJacobian(by_inverted, none) - invertedBy(a)).norm(), 1e-7);
  }
}

TEST(LevelPose, AGaussianInvertedTwiceIsTheSame) {
  std::mt19937 random(3);
  LevelGaussian T{randomPose(random), Eigen::Matrix4d::Random()};
  T.covariance = (T.covariance * T.covariance.transpose()).eval();
  const LevelGaussian same = inverse(inverse(T));
  EXPECT_LT(difference(same.mean, T.mean).norm(), 1e-12);
  EXPECT_LT((same.covariance - T.covariance).norm(), 1e-10 * T.covariance.norm());
}

TEST(LevelPose, AnUncertainYawMovesWhatIsFarAhead) {
  LevelGaussian turn, ahead;
  turn.covariance(3, 3) = 0.01 * 0.01;
  ahead.mean.p.x() = 100.0;
  const LevelGaussian far = compose(turn, ahead);
  EXPECT_NEAR(far.covariance(1, 1), 1.0, 1e-12);
  EXPECT_NEAR(far.covariance(0, 0), 0.0, 1e-12);
  EXPECT_NEAR(far.covariance(1, 3), 0.01, 1e-12);
}

TEST(Levelled, KeepsTheHorizontalDirectionOfTheXAxis) {
  const Eigen::Vector3d up(0.02, -0.03, 1.0);
  const RigidTransform T_AB(expQuaternion({0.1, -0.2, 1.3}), {1.0, 2.0, 3.0});
  const RigidTransform level = levelled(T_AB, up.normalized());
  EXPECT_LT((level.R().col(2) - up.normalized()).norm(), 1e-12);
  EXPECT_LT((level.p - T_AB.p).norm(), 1e-12);
  EXPECT_NEAR(level.R().determinant(), 1.0, 1e-12);
  EXPECT_NEAR(level.R().col(1).dot(T_AB.R().col(0)), 0.0, 1e-12);
  EXPECT_GT(level.R().col(0).dot(T_AB.R().col(0)), 0.9);
}

TEST(Levelled, TakesTheZAxisWhereXIsVertical) {
  Eigen::Matrix3d R;
  R.col(0) = Eigen::Vector3d::UnitZ();
  R.col(2) = rotationAboutZ(0.7).col(0);
  R.col(1) = R.col(2).cross(R.col(0));
  EXPECT_NEAR(yawOf(levelled({R, Eigen::Vector3d::Zero()}, Eigen::Vector3d::UnitZ()).R()), 0.7,
              1e-12);
}

}  // namespace
}  // namespace perdure::mapping
