#include "services/semantic_filter/core/measurement/cuboid_projection.h"

#include <gtest/gtest.h>

#include "common/math/numeric_jacobian.h"
#include "common/math/so3.h"
#include "services/semantic_filter/core/measurement/box_likelihood.h"
#include "tests/services/semantic_filter/scene.h"

namespace perdure::semantic_filter {
namespace {

using testing::makeCamera;
using testing::makeState;

class CuboidProjection : public ::testing::Test {
 protected:
  CuboidProjection() {
    view.camera = &camera;
    view.T_WB = RigidTransform(expQuaternion({0.02, -0.03, 0.4}), {1.0, -2.0, 1.3});
    view.up_W = Eigen::Vector3d(0.02, -0.04, 1.0).normalized();
  }
  CameraModel camera{makeCamera()};
  View view;
  State x = makeState(12.0, 4.5, 0.6, 0.9, 4.1, 1.7, 1.5);
};

TEST_F(CuboidProjection, JacobianByTheStateMatchesDifferences) {
  const auto box = projectCuboid(x, view);
  ASSERT_TRUE(box);
  const auto f = [&](const Eigen::VectorXd& v) -> Eigen::VectorXd {
    return projectCuboid(State(v), view)->sides;
  };
  const Eigen::MatrixXd numeric = numericJacobian(f, x);
  EXPECT_LT((box->H - numeric).cwiseAbs().maxCoeff(), 1e-4 * (1.0 + numeric.cwiseAbs().maxCoeff()));
  EXPECT_GT(box->H.cwiseAbs().maxCoeff(), 10.0);
}

TEST_F(CuboidProjection, JacobianByThePoseMatchesDifferences) {
  const auto box = projectCuboid(x, view);
  ASSERT_TRUE(box);
  const auto f = [&](const Eigen::VectorXd& v) -> Eigen::VectorXd {
    View moved = view;
    moved.T_WB = boxPlus(view.T_WB, v);
    return projectCuboid(x, moved)->sides;
  };
  const Eigen::MatrixXd numeric = numericJacobian(f, Eigen::VectorXd::Zero(6));
  EXPECT_LT((box->H_pose - numeric).cwiseAbs().maxCoeff(),
            1e-4 * (1.0 + numeric.cwiseAbs().maxCoeff()));
}

TEST_F(CuboidProjection, DetectorBiasMovesEachSideByItsShareOfTheBox) {
  x.segment<4>(kBias) << 0.1, -0.05, 0.02, 0.03;
  const auto plain = projectCuboid(x, view), seen = projectObserved(x, view, BoxStyle());
  ASSERT_TRUE(plain && seen);
  const double width = plain->sides[2] - plain->sides[0];
  const double height = plain->sides[3] - plain->sides[1];
  EXPECT_NEAR(seen->sides[0] - plain->sides[0], 0.1 * width, 1e-9);
  EXPECT_NEAR(seen->sides[3] - plain->sides[3], 0.03 * height, 1e-9);
  const auto by_object = [&](const Eigen::VectorXd& v) -> Eigen::VectorXd {
    return projectObserved(State(v), view, BoxStyle())->sides;
  };
  const auto by_pose = [&](const Eigen::VectorXd& v) -> Eigen::VectorXd {
    View moved = view;
    moved.T_WB = boxPlus(view.T_WB, v);
    return projectObserved(x, moved, BoxStyle())->sides;
  };
  const Eigen::MatrixXd H = numericJacobian(by_object, x);
  const Eigen::MatrixXd H_pose = numericJacobian(by_pose, Eigen::VectorXd::Zero(6));
  EXPECT_LT((seen->H - H).cwiseAbs().maxCoeff(), 1e-4 * (1.0 + H.cwiseAbs().maxCoeff()));
  EXPECT_LT((seen->H_pose - H_pose).cwiseAbs().maxCoeff(),
            1e-4 * (1.0 + H_pose.cwiseAbs().maxCoeff()));
}

/// A car: its wheels are within its length, its corners are round, and its roof is narrower than
/// its body.
Shape roundShape() {
  return shapeOf({{-1.0, 0.65, 0.9, 1.0}, {0.0, 1.0, 1.0, 0.8}, {1.0, 0.2, 0.65, 0.7, -0.3}});
}

TEST_F(CuboidProjection, AShapeLiesWithinItsCuboidAndCutsTheLowerCornersOff) {
  const Shape shape = roundShape();
  EXPECT_EQ(shape.corners(), 20) << "a level without cut corners has four";
  const auto whole = projectCuboid(x, view), round = projectCuboid(x, view, shape);
  ASSERT_TRUE(whole && round);
  for (int side = 0; side < 4; ++side) {
    const double inside = (side < 2 ? 1 : -1) * (round->sides[side] - whole->sides[side]);
    EXPECT_GE(inside, 0.0) << side;
  }
  const double height = whole->sides[3] - whole->sides[1];
  EXPECT_GT(whole->sides[3] - round->sides[3], 0.03 * height);
}

TEST_F(CuboidProjection, TheCuboidIsAShapeToo) {
  const auto plain = projectCuboid(x, view);
  const auto shaped = projectCuboid(x, view, shapeOf({{-1, 1, 1, 1}, {1, 1, 1, 1}}));
  ASSERT_TRUE(plain && shaped);
  EXPECT_EQ(plain->sides, shaped->sides);
  EXPECT_EQ(plain->H, shaped->H);
}

TEST_F(CuboidProjection, JacobiansOfAShapeMatchDifferences) {
  const BoxStyle style{Eigen::Vector4d(0.02, -0.01, 0.03, 0.0), roundShape()};
  x.segment<4>(kBias) << 0.1, -0.05, 0.02, 0.03;
  const auto box = projectObserved(x, view, style, 0.6);
  ASSERT_TRUE(box);
  const auto by_object = [&](const Eigen::VectorXd& v) -> Eigen::VectorXd {
    return projectObserved(State(v), view, style, 0.6)->sides;
  };
  const auto by_pose = [&](const Eigen::VectorXd& v) -> Eigen::VectorXd {
    View moved = view;
    moved.T_WB = boxPlus(view.T_WB, v);
    return projectObserved(x, moved, style, 0.6)->sides;
  };
  const Eigen::MatrixXd H = numericJacobian(by_object, x);
  const Eigen::MatrixXd H_pose = numericJacobian(by_pose, Eigen::VectorXd::Zero(6));
  EXPECT_LT((box->H - H).cwiseAbs().maxCoeff(), 1e-4 * (1.0 + H.cwiseAbs().maxCoeff()));
  EXPECT_LT((box->H_pose - H_pose).cwiseAbs().maxCoeff(),
            1e-4 * (1.0 + H_pose.cwiseAbs().maxCoeff()));
}

TEST_F(CuboidProjection, AShapeWithTheOppositeHeadingIsTheOneTurnedBy180Degrees) {
  const Shape shape = roundShape();
  State turned = x;
  turned[kYaw] = wrapAngle(x[kYaw] + M_PI);
  const auto backwards = projectCuboid(x, view, shape, -1.0),
             other = projectCuboid(turned, view, shape, 1.0);
  const auto forwards = projectCuboid(x, view, shape, 1.0), either = projectCuboid(x, view, shape);
  ASSERT_TRUE(backwards && other && forwards && either);
  EXPECT_LT((backwards->sides - other->sides).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_GT((backwards->sides - forwards->sides).cwiseAbs().maxCoeff(), 1.0) << "pixels";
  EXPECT_EQ(either->sides, projectCuboid(turned, view, shape)->sides);
  EXPECT_NEAR(headingOf(0.0), 0.0, 1e-12);
  EXPECT_GT(headingOf(6.0), 0.99);
  EXPECT_EQ(headingOf(-2.0), -headingOf(2.0));
}

TEST_F(CuboidProjection, AShapeThatReachesTheNearPlaneIsItsCuboid) {
  const State beside =
      makeState(view.T_WB.p.x() + 1.0, view.T_WB.p.y() - 2.0, 0.5, 0.4, 5.0, 2.0, 1.5);
  const auto whole = projectCuboid(beside, view), round = projectCuboid(beside, view, roundShape());
  ASSERT_TRUE(whole && round);
  EXPECT_EQ(whole->sides, round->sides);
  EXPECT_EQ(whole->exact, round->exact);
}

TEST_F(CuboidProjection, LinearCovarianceOfTheBoxMatchesMonteCarlo) {
  Hypothesis h;
  h.x = x;
  h.P.setZero();
  h.P.diagonal().head<7>() << 0.04, 0.04, 0.01, 0.0009, 0.0016, 0.0016, 0.0016;
  Matrix6d P_pose = Matrix6d::Zero();
  P_pose.diagonal() << 1e-6, 1e-6, 1e-6, 1e-3, 1e-3, 1e-3;
  const auto box = projectCuboid(x, view);
  const Eigen::Matrix4d linear = predictedCovariance(h, *box, P_pose);
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  constexpr int kSamples = 20000;
  Eigen::Vector4d sum = Eigen::Vector4d::Zero();
  Eigen::Matrix4d squares = Eigen::Matrix4d::Zero();
  for (int n = 0; n < kSamples; ++n) {
    State y = x;
    Eigen::Matrix<double, 6, 1> g;
    for (int i = 0; i < kBias; ++i) y[i] += std::sqrt(h.P(i, i)) * normal(random);
    for (int i = 0; i < 6; ++i) g[i] = std::sqrt(P_pose(i, i)) * normal(random);
    View moved = view;
    moved.T_WB = boxPlus(view.T_WB, g);
    const Eigen::Vector4d s = projectCuboid(y, moved)->sides - box->sides;
    sum += s;
    squares += s * s.transpose();
  }
  sum /= kSamples;
  const Eigen::Matrix4d sampled = squares / kSamples - sum * sum.transpose();
  for (int i = 0; i < 4; ++i) EXPECT_NEAR(linear(i, i) / sampled(i, i), 1.0, 0.1) << "side " << i;
}

TEST_F(CuboidProjection, SidesCutByTheNearPlaneAreNotExact) {
  const State beside =
      makeState(view.T_WB.p.x() + 1.0, view.T_WB.p.y() - 2.0, 0.5, 0.4, 5.0, 2.0, 1.5);
  const auto box = projectCuboid(beside, view);
  ASSERT_TRUE(box);
  EXPECT_FALSE(box->exact[0] && box->exact[1] && box->exact[2] && box->exact[3]);
}

TEST_F(CuboidProjection, AnObjectBehindTheCameraHasNoImage) {
  EXPECT_FALSE(projectCuboid(makeState(-20, -10, 0.5, 0, 4, 2, 1.5), view));
}

TEST_F(CuboidProjection, AzimuthAndYawAgreeWhateverTheRollOfTheCamera) {
  // A car across the view, straight ahead. With rotation_y = 0 its length is along the camera's x
  // axis. This is the body's right, yaw -90° in a level world.
  View level;
  level.camera = &camera;
  const Eigen::Vector3d ahead(10.3, 0.0, 0.5);
  const double yaw = yawFromAzimuth(0.0, ahead, level);
  EXPECT_NEAR(yaw, -M_PI / 2, 1e-9);
  View rolled = level;
  rolled.T_WB = RigidTransform(expQuaternion({M_PI / 3, 0, 0}), Eigen::Vector3d(0, 0, 0));
  const Eigen::Vector3d centre = rolled.T_WC().p + rolled.T_WC().R() * Eigen::Vector3d(0, 0, 10);
  EXPECT_NEAR(yawFromAzimuth(0.0, centre, rolled), yaw, 1e-9);
}

TEST_F(CuboidProjection, AzimuthIsRotationMinusBearing) {
  View level;
  level.camera = &camera;
  const Eigen::Vector3d right_ahead(10.3, -10.0, 0.5);  // 45° to the right of the optical axis
  EXPECT_NEAR(yawFromAzimuth(0.0, right_ahead, level), -M_PI / 2 - M_PI / 4, 1e-9);
}

}  // namespace
}  // namespace perdure::semantic_filter
