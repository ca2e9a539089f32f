// Compares the box that the border leaves with points sampled over the whole cuboid.
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "common/math/numeric_jacobian.h"
#include "common/math/so3.h"
#include "services/semantic_filter/core/measurement/cuboid_projection.h"
#include "tests/services/semantic_filter/scene.h"

namespace perdure::semantic_filter {
namespace {

using testing::makeCamera;
using testing::makeState;

class ImageBorder : public ::testing::Test {
 protected:
  void use(const CameraCalibration& calibration) {
    camera = CameraModel(calibration);
    view.camera = &camera;
    view.T_WB = RigidTransform(expQuaternion({0.02, -0.03, 0.04}), {0.0, 0.0, 1.3});
  }
  Eigen::Vector4d observed(const State& state, const RigidTransform& T_WB) const {
    View at = view;
    at.T_WB = T_WB;
    return projectObserved(state, at, BoxStyle())->sides;
  }
  /// Range of one coordinate over the cuboid's surface points whose other coordinate is within the
  /// image.
  Eigen::Vector2d sampled(const State& state, int axis) const {
    constexpr int kSteps = 300;
    const double extent = axis == 0 ? camera.height() : camera.width();
    const Eigen::Vector3d size = state.segment<3>(kSize).array().exp();
    Eigen::Vector2d range(std::numeric_limits<double>::infinity(),
                          -std::numeric_limits<double>::infinity());
    for (int face = 0; face < 6; ++face) {
      for (int i = 0; i <= kSteps; ++i) {
        for (int j = 0; j <= kSteps; ++j) {
          Eigen::Vector3d c;
          c[face / 2] = face % 2 - 0.5;
          c[(face / 2 + 1) % 3] = double(i) / kSteps - 0.5;
          c[(face / 2 + 2) % 3] = double(j) / kSteps - 0.5;
          const Eigen::Vector3d p_W =
              state.head<3>() + rotationAboutZ(state[kYaw]) * c.cwiseProduct(size);
          const auto pixel = camera.project(view.T_WC().inverse() * p_W);
          if (!pixel || (*pixel)[1 - axis] < 0.0 || (*pixel)[1 - axis] > extent) continue;
          range = {std::min(range[0], (*pixel)[axis]), std::max(range[1], (*pixel)[axis])};
        }
      }
    }
    return range;
  }
  void expectDerivatives(const State& state, const std::vector<int>& sides) const {
    const auto box = projectObserved(state, view, BoxStyle());
    const Eigen::MatrixXd H = numericJacobian(
        [&](const Eigen::VectorXd& v) -> Eigen::VectorXd { return observed(v, view.T_WB); }, state);
    const Eigen::MatrixXd H_pose = numericJacobian(
        [&](const Eigen::VectorXd& v) -> Eigen::VectorXd {
          return observed(state, boxPlus(view.T_WB, v));
        },
        Eigen::VectorXd::Zero(6));
    for (const int side : sides) {
      EXPECT_TRUE(box->exact[side]) << side;
      EXPECT_LT((box->H.row(side) - H.row(side)).cwiseAbs().maxCoeff(),
                1e-4 * (1.0 + H.row(side).cwiseAbs().maxCoeff()))
          << side;
      EXPECT_LT((box->H_pose.row(side) - H_pose.row(side)).cwiseAbs().maxCoeff(),
                1e-4 * (1.0 + H_pose.row(side).cwiseAbs().maxCoeff()))
          << side;
    }
  }

  CameraModel camera{makeCamera()};
  View view;
};

TEST_F(ImageBorder, AnObjectInsideHasItsWholeBox) {
  use(makeCamera());
  const State x = makeState(14.0, 3.0, 0.75, 0.6, 4.2, 1.75, 1.5);
  EXPECT_EQ(projectObserved(x, view, BoxStyle())->sides, projectCuboid(x, view)->sides);
}

TEST_F(ImageBorder, OfAnObjectThatTheLeftBorderCutsTheFarPartRemains) {
  use(makeCamera());
  const State x = makeState(10.6, 9.2, 0.75, 0.0, 4.2, 1.75, 1.5);
  const auto whole = projectCuboid(x, view), seen = projectObserved(x, view, BoxStyle());
  ASSERT_LT(whole->sides[0], 0.0);
  const Eigen::Vector2d rows = sampled(x, 1);
  EXPECT_NEAR(seen->sides[1], rows[0], 1.0);
  EXPECT_NEAR(seen->sides[3], rows[1], 1.0);
  ASSERT_LT(whole->sides[3], camera.height());
  EXPECT_GT(whole->sides[3] - seen->sides[3], 10.0);  // the near corner is outside
  EXPECT_EQ(seen->sides[0], whole->sides[0]);
  EXPECT_EQ(seen->sides[2], whole->sides[2]);
  expectDerivatives(x, {0, 1, 2, 3});
}

TEST_F(ImageBorder, AnObjectBesideTheCameraHasExactSidesInsideTheImage) {
  use(makeCamera());
  const State x = makeState(2.5, 2.2, 0.75, 0.1, 5.0, 1.75, 1.5);
  const auto whole = projectCuboid(x, view), seen = projectObserved(x, view, BoxStyle());
  ASSERT_FALSE(whole->exact[3]);  // cut by the near plane
  const Eigen::Vector2d rows = sampled(x, 1);
  EXPECT_NEAR(seen->sides[1], rows[0], 2.0);
  EXPECT_NEAR(seen->sides[3], rows[1], 0.01 * rows[1]);  // far below the image
  expectDerivatives(x, {1, 2, 3});
}

TEST_F(ImageBorder, HoldsWithDistortion) {
  CameraCalibration calibration = makeCamera();
  calibration.distortion = DistortionModel::kRadialTangential;
  calibration.distortion_coefficients = {-0.1, 0.02, 0.0, 0.0};
  use(calibration);
  const State x = makeState(6.0, 4.0, 0.75, 0.3, 4.2, 1.75, 1.5);
  const auto seen = projectObserved(x, view, BoxStyle());
  const Eigen::Vector2d rows = sampled(x, 1);
  EXPECT_NEAR(seen->sides[1], rows[0], 1.0);
  EXPECT_NEAR(seen->sides[3], rows[1], 1.0);
  expectDerivatives(x, {1, 3});
}

TEST_F(ImageBorder, ASideMovesWithoutAJumpAsTheObjectLeaves) {
  use(makeCamera());
  double before = 0.0;
  for (int i = 0; i < 200; ++i) {
    const State x = makeState(8.0 - 0.02 * i, 3.5, 0.75, 0.3, 4.2, 1.75, 1.5);
    const double bottom = projectObserved(x, view, BoxStyle())->sides[3];
    if (i > 0) {
      EXPECT_LT(std::abs(bottom - before), 6.0) << i;
    }
    before = bottom;
  }
}

}  // namespace
}  // namespace perdure::semantic_filter
