// Compares every analytic Jacobian of the updates with a numeric one.
#include <gtest/gtest.h>

#include "common/math/numeric_jacobian.h"
#include "common/math/so3.h"
#include "services/vio/core/update/triangulation.h"
#include "services/vio/core/update/updates.h"
#include "services/vio/core/update/visual.h"
#include "tests/services/vio/simulated_drive.h"

namespace perdure::vio {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;

Nav someMotion() {
  Nav nav;
  nav.q_WB = expQuaternion(Vector3d(0.3, -0.2, 0.9));
  nav.p_WB = {0.4, -0.3, 0.2};
  nav.v_WB = {1.5, -0.7, 0.3};
  nav.gyro_bias = {0.02, -0.05, 0.03};
  nav.accel_bias = {0.1, 0.2, -0.15};
  return nav;
}

State someState(int clones) {
  test::SimulatedDrive drive({});
  State state(drive.T_BC(), 0.003, clones + 1, 5);
  state.nav = state.nav_linear = someMotion();
  Eigen::MatrixXd A = Eigen::MatrixXd::Random(state.size(), state.size());
  state.P() = 1e-4 * (A * A.transpose() + Eigen::MatrixXd::Identity(A.rows(), A.cols()));
  return state;
}

TEST(VisualJacobians, PoseExtrinsicsAndPointAgreeWithNumericOnes) {
  const RigidTransform T_WB(expQuaternion(Vector3d(0.1, 0.2, -0.4)), Vector3d(0.5, 1, -0.2));
  const RigidTransform T_BC = test::testCamera(0).T_BC;
  const Vector3d p_W = (T_WB * T_BC) * Vector3d(0.7, -0.4, 3.1);
  Vector2d z;
  ProjectionJacobians J;
  ASSERT_TRUE(projectPoint(T_WB, T_BC, p_W, z, &J));
  const auto f = [&](const VectorXd& d) -> VectorXd {
    Vector2d uv;
    EXPECT_TRUE(projectPoint(boxPlus(T_WB, d.head<6>()), boxPlus(T_BC, d.segment<6>(6)),
                             p_W + d.tail<3>(), uv));
    return uv;
  };
  Eigen::MatrixXd analytic(2, 15);
  analytic << J.pose, J.extrinsic, J.point;
  EXPECT_LT((numericJacobian(f, VectorXd::Zero(15)) - analytic).cwiseAbs().maxCoeff(), 1e-7);
}

TEST(VisualJacobians, APointBehindTheCameraIsRefused) {
  Vector2d z;
  EXPECT_FALSE(projectPoint(RigidTransform(), RigidTransform(), Vector3d(0, 0, -1), z));
}

TEST(SpeedJacobian, AgreesWithTheNumericOne) {
  const Nav nav = someMotion();
  Eigen::Matrix<double, 3, 6> J;
  bodyVelocity(nav, &J);
  const auto f = [&](const VectorXd& d) -> VectorXd {
    Nav n = nav;
    n.q_WB = nav.q_WB * expQuaternion(d.head<3>());
    n.v_WB += d.tail<3>();
    return bodyVelocity(n);
  };
  EXPECT_LT((numericJacobian(f, VectorXd::Zero(6)) - J).cwiseAbs().maxCoeff(), 1e-7);
}

TEST(RestJacobian, AgreesWithTheNumericOne) {
  const Nav nav = someMotion();
  Eigen::Matrix<double, 6, 9> J;
  restPrediction(nav, 9.81, &J);
  const auto f = [&](const VectorXd& d) -> VectorXd {
    Nav n = nav;
    n.q_WB = nav.q_WB * expQuaternion(d.head<3>());
    n.gyro_bias += d.segment<3>(3);
    n.accel_bias += d.tail<3>();
    return restPrediction(n, 9.81);
  };
  EXPECT_LT((numericJacobian(f, VectorXd::Zero(9)) - J).cwiseAbs().maxCoeff(), 1e-7);
}

TEST(CloneJacobian, FollowsTheTimeOffsetWithRateAndVelocity) {
  State state = someState(2);
  const Vector3d rate(0.4, -0.2, 0.7);
  const Eigen::MatrixXd before = state.P();
  state.addClone(5, fromNanoseconds(0), rate, false);
  Eigen::MatrixXd J = Eigen::MatrixXd::Zero(6, before.cols());
  J.leftCols<6>().setIdentity();
  // Pose at t + δ: R Exp(w δ), p + v δ.
  const Nav nav = state.nav;
  const auto f = [&](const VectorXd& d) -> VectorXd {
    const RigidTransform later(nav.q_WB * expQuaternion(rate * d[0]), nav.p_WB + nav.v_WB * d[0]);
    return boxMinus(later, nav.T_WB());
  };
  J.col(state.timeOffsetAt()) = numericJacobian(f, VectorXd::Zero(1));
  const int at = state.clones.back().at, n = static_cast<int>(before.cols());
  EXPECT_LT((state.P().block(at, 0, 6, n) - J * before).cwiseAbs().maxCoeff(), 1e-10);
  EXPECT_LT((state.P().block(at, at, 6, 6) - J * before * J.transpose()).cwiseAbs().maxCoeff(),
            1e-10);
}

TEST(NoMotionUpdate, BringsTwoClonesTogether) {
  State state = someState(2);
  state.addClone(1, fromNanoseconds(0), Vector3d::Zero(), true);
  state.nav.p_WB += Vector3d(0.02, 0.01, -0.02);
  state.nav.q_WB = state.nav.q_WB * expQuaternion(Vector3d(0.004, -0.003, 0.002));
  auto P = state.P();
  P.topLeftCorner<6, 6>().diagonal().array() += 1e-3;
  state.addClone(2, fromNanoseconds(1), Vector3d::Zero(), true);
  RestOptions options;
  ASSERT_TRUE(updateNoMotion(state, 1, 2, options));
  const auto d = boxMinus(state.clones[1].T_WB, state.clones[0].T_WB);
  EXPECT_LT(d.head<3>().norm(), 5e-4);
  EXPECT_LT(d.tail<3>().norm(), 3e-3);
}

TEST(StackedViews, TheNullSpaceDoesNotSeeThePoint) {
  test::DriveOptions options;
  options.stereo = true;
  test::SimulatedDrive drive(options);
  State state(drive.T_BC(), 0.0, 12, 5);
  FeatureDatabase database;
  for (std::uint64_t k = 0; k < 8; ++k) {
    state.nav = state.nav_linear = drive.truth(0.05 * static_cast<double>(k));
    state.addClone(k, drive.time(0.0), Vector3d::Zero(), true);
    database.add(k, drive.see(0.05 * static_cast<double>(k)));
  }
  int tried = 0;
  for (const auto& [id, track] : database.tracks()) {
    if (track.observations.size() < 8) continue;
    const auto point = triangulate(raysOf(track, state, 1.0), VisionOptions{});
    if (!point) continue;
    PointSystem s = stackViews(track, state, point->p_W, 1.0);
    const PointSystem whole = s;
    separatePoint(s);
    EXPECT_LT(s.H_f.bottomRows(s.H_f.rows() - 3).norm(), 1e-9);
    EXPECT_NEAR(s.r.norm(), whole.r.norm(), 1e-9);
    EXPECT_NEAR(s.H_x.norm(), whole.H_x.norm(), 1e-6 * whole.H_x.norm());
    dropPoint(s);
    EXPECT_EQ(s.r.size(), whole.r.size() - 3);
    ++tried;
  }
  EXPECT_GT(tried, 10);
}

TEST(StackedViews, CompressionKeepsTheInformation) {
  Eigen::MatrixXd H = Eigen::MatrixXd::Random(40, 7);
  Eigen::VectorXd r = VectorXd::Random(40);
  const Eigen::MatrixXd information = H.transpose() * H;
  const VectorXd score = H.transpose() * r;
  compress(H, r);
  EXPECT_EQ(H.rows(), 7);
  EXPECT_LT((H.transpose() * H - information).norm(), 1e-10);
  EXPECT_LT((H.transpose() * r - score).norm(), 1e-10);
}

TEST(Triangulation, FindsThePointWithinItsCovariance) {
  test::DriveOptions options;
  options.seed = 3;
  test::SimulatedDrive drive(options);
  State state(drive.T_BC(), 0.0, 12, 5);
  Track track{1, {}};
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  double nees = 0.0;
  int count = 0;
  for (std::uint64_t k = 0; k < 10; ++k) {
    state.nav = state.nav_linear = drive.truth(0.1 * static_cast<double>(k));
    state.addClone(k, drive.time(0.0), Vector3d::Zero(), true);
  }
  for (int run = 0; run < 200; ++run) {
    const Vector3d p_C(normal(random), normal(random), 6.0);
    const Vector3d p_W = state.clones[5].T_WB * (state.T_BC[0] * p_C);
    track.observations.clear();
    for (const Clone& c : state.clones) {
      const auto pixel = drive.cameras()[0].project((c.T_WB * state.T_BC[0]).inverse() * p_W);
      if (!pixel) continue;
      const Vector2d noisy = *pixel + Vector2d(normal(random), normal(random));
      track.observations.push_back({c.frame, {imagePoint(drive.cameras()[0], noisy), {}}});
    }
    const auto point = triangulate(raysOf(track, state, 1.0), VisionOptions{});
    if (!point) continue;
    const Vector3d e = point->p_W - p_W;
    nees += e.dot(point->covariance.inverse() * e);
    ++count;
  }
  EXPECT_GT(count, 150);
  EXPECT_NEAR(nees / count, 3.0, 0.6);
}

TEST(Triangulation, RefusesRaysWithoutParallax) {
  const RigidTransform T;
  const auto point = triangulate({{T, Vector2d(0.1, 0.2), 400.0}, {T, Vector2d(0.1, 0.2), 400.0}},
                                 VisionOptions{});
  ASSERT_FALSE(point);
  EXPECT_EQ(point.error().code, "triangulation_parallel");
}

}  // namespace
}  // namespace perdure::vio
