#include "common/math/so3.h"

#include <gtest/gtest.h>

#include <numbers>
#include <random>

#include "common/math/numeric_jacobian.h"
#include "common/math/rigid_transform.h"

namespace perdure {
namespace {

Eigen::Vector3d randomVector(std::mt19937& random, double scale) {
  std::uniform_real_distribution<double> u(-scale, scale);
  return {u(random), u(random), u(random)};
}

TEST(So3, LogarithmInvertsExponentialFromTinyToHalfATurn) {
  std::mt19937 random(1);
  for (const double scale : {1e-12, 1e-8, 1e-5, 1e-3, 0.1, 1.7}) {
    for (int i = 0; i < 50; ++i) {
      const Eigen::Vector3d theta = randomVector(random, scale);
      EXPECT_LT((logSo3(expQuaternion(theta)) - theta).norm(), 1e-9 * std::max(1.0, scale));
    }
  }
}

TEST(So3, ExponentialAgreesWithTheAngleAxisOfEigen) {
  const Eigen::Vector3d theta(0.3, -1.1, 0.7);
  const Eigen::Matrix3d expected =
      Eigen::AngleAxisd(theta.norm(), theta.normalized()).toRotationMatrix();
  EXPECT_LT((expSo3(theta) - expected).norm(), 1e-12);
}

TEST(So3, RightJacobianMatchesTheNumericOne) {
  std::mt19937 random(2);
  for (const double scale : {1e-6, 1e-2, 1.0}) {
    const Eigen::Vector3d theta = randomVector(random, scale);
    const Eigen::Quaterniond base = expQuaternion(theta);
    const auto f = [&](const Eigen::VectorXd& d) -> Eigen::VectorXd {
      return logSo3(base.conjugate() * expQuaternion(theta + Eigen::Vector3d(d)));
    };
    const Eigen::MatrixXd J = numericJacobian(f, Eigen::Vector3d::Zero(), 1e-5);
    EXPECT_LT((J - rightJacobianSo3(theta)).norm(), 1e-8);
    EXPECT_LT((rightJacobianSo3(theta) * rightJacobianInverseSo3(theta) -
               Eigen::Matrix3d::Identity()).norm(), 1e-9);
  }
}

TEST(So3, WrapAngleStaysInHalfOpenInterval) {
  using std::numbers::pi;
  EXPECT_NEAR(wrapAngle(3 * pi), pi, 1e-12);
  EXPECT_NEAR(wrapAngle(-pi), pi, 1e-12);
  EXPECT_NEAR(wrapAngle(7.0), 7.0 - 2 * pi, 1e-12);
}

TEST(So3, YawOfARotationAboutTheVerticalIsItsAngle) {
  for (const double yaw : {-3.0, -0.5, 0.0, 1.2, 3.1}) {
    EXPECT_NEAR(yawOf(rotationAboutZ(yaw)), yaw, 1e-12);
  }
}

TEST(RigidTransform, BoxMinusInvertsBoxPlusAndProductsCancel) {
  std::mt19937 random(3);
  const RigidTransform T(expQuaternion(randomVector(random, 1.0)), randomVector(random, 5.0));
  Eigen::Matrix<double, 6, 1> delta;
  delta << randomVector(random, 0.5), randomVector(random, 2.0);
  EXPECT_LT((boxMinus(boxPlus(T, delta), T) - delta).norm(), 1e-9);
  const Eigen::Vector3d point(1, 2, 3);
  EXPECT_LT((T.inverse() * (T * point) - point).norm(), 1e-12);
}

TEST(So3, LevellingTakesUpToZWithoutYaw) {
  for (const Eigen::Vector3d& up : {Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(0.3, -0.2, 0.9),
                                    Eigen::Vector3d(2, 0, 0), Eigen::Vector3d(1e-7, 0, -1),
                                    Eigen::Vector3d(0, 0, -3)}) {
    const Eigen::Quaterniond q = levelling(up);
    EXPECT_NEAR(q.norm(), 1.0, 1e-9) << up.transpose();
    EXPECT_LT((q * up.normalized() - Eigen::Vector3d::UnitZ()).norm(), 1e-6) << up.transpose();
    EXPECT_EQ(q.z(), 0.0) << "about a horizontal axis";
  }
}

}  // namespace
}  // namespace perdure
