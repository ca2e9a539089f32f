#include "tools/pipeline/drifting_odometry.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "common/math/gaussian.h"
#include "common/math/so3.h"
#include "tests/common/replay/tiny_datasets.h"
#include "tools/pipeline/pipeline.h"

namespace perdure::tools {
namespace {

FrameStamp stampAt(std::uint64_t frame) {
  FrameStamp stamp;
  stamp.source = 1;
  stamp.sequence = frame;
  stamp.time = fromNanoseconds(static_cast<std::int64_t>(frame) * 200'000'000);
  return stamp;
}

/// Two metres per frame, with bends and hills and a small roll.
replay::PoseFile bends(std::size_t frames) {
  std::vector<replay::StampedPose> poses;
  Eigen::Vector3d p(3, -2, 1);
  for (std::size_t i = 0; i < frames; ++i) {
    const double s = static_cast<double>(i), yaw = 0.4 + 1.2 * std::sin(0.02 * s);
    const Eigen::Quaterniond q =
        Eigen::Quaterniond(rotationAboutZ(yaw)) * expQuaternion({0.02 * std::sin(s), 0.01, 0});
    poses.push_back({stampAt(i).time, RigidTransform(q, p)});
    p += rotationAboutZ(yaw) * Eigen::Vector3d(2, 0, 0.1 * std::cos(0.05 * s));
  }
  return replay::PoseFile(replay::PoseFormat::kTum, poses);
}

std::vector<Odometry> driven(const replay::PoseFile& truth, const DriftConfig& config) {
  DriftingOdometry source(truth, 2, {1, 0}, ofExactTruth(), config);
  std::vector<Odometry> all;
  for (std::size_t i = 0; i < truth.poses().size(); ++i) all.push_back(*source.at(stampAt(i)));
  return all;
}

TEST(DriftingOdometry, WithoutDriftItIsTheTruth) {
  const auto truth = bends(200);
  PoseOdometry exact(truth, 2, {1, 0}, ofExactTruth());
  for (const auto& odometry : driven(truth, {.scale = 0.0, .yaw_walk = 0.0})) {
    const auto expected = *exact.at(odometry.stamp);
    EXPECT_LT(boxMinus(odometry.T_WB, expected.T_WB).norm(), 1e-9);
    EXPECT_LT((odometry.v_WB - expected.v_WB).norm(), 1e-9);
    EXPECT_EQ(odometry.has_increment, expected.has_increment);
    EXPECT_EQ(odometry.increment_from, expected.increment_from);
    EXPECT_LT(std::sqrt(odometry.covariance.diagonal().maxCoeff()), 0.01);
  }
}

TEST(DriftingOdometry, TheWayIsLongerByTheScaleAndGravityStaysExact) {
  const auto truth = bends(200);
  const auto all = driven(truth, {.scale = 0.01});
  double true_way = 0.0, way = 0.0;
  for (std::size_t i = 1; i < all.size(); ++i) {
    const RigidTransform& there = truth.poses()[i].T_WB;
    true_way += (there.p - truth.poses()[i - 1].T_WB.p).norm();
    way += (all[i].T_WB.p - all[i - 1].T_WB.p).norm();
    EXPECT_TRUE(all[i].T_WB.R().row(2).isApprox(there.R().row(2), 1e-9));
    EXPECT_EQ(all[i].up_W, Eigen::Vector3d(Eigen::Vector3d::UnitZ()));
  }
  EXPECT_NEAR(way, 1.01 * true_way, 1e-6);
}

TEST(DriftingOdometry, AFrameOfItsOwnBeginsLevelAtTheBody) {
  const auto truth = bends(100);
  const auto own = driven(truth, {.own_frame = true});
  EXPECT_TRUE(own[0].T_WB.p.isZero());
  EXPECT_NEAR(yawOf(own[0].T_WB.R()), 0.0, 1e-12);
  EXPECT_TRUE(own[0].T_WB.R().row(2).isApprox(truth.poses()[0].T_WB.R().row(2), 1e-9));
  const auto shared = driven(truth, {});
  EXPECT_LT(boxMinus(shared[0].T_WB, truth.poses()[0].T_WB).norm(), 1e-12);
  const auto moved = [](const std::vector<Odometry>& all) {
    return all.front().T_WB.inverse() * all.back().T_WB;
  };
  EXPECT_LT(boxMinus(moved(own), moved(shared)).norm(), 1e-9) << "the same drift in either frame";
}

/// The propagation of u and s: yaw and position error, and the relative excess of the distance.
TEST(DriftCovariance, GrowsAsTheNumericJacobianOfAStepSays) {
  using Vector5 = Eigen::Matrix<double, 5, 1>;
  const Eigen::Vector3d step(1.5, -0.7, 0.2);
  const auto moved = [&](const Eigen::VectorXd& e) {
    Eigen::VectorXd next = e;
    next.segment<3>(1) += (1.0 + e(4)) * (rotationAboutZ(e(0)) * step);
    return next;
  };
  Eigen::Matrix<double, 5, 5> J;
  for (Eigen::Index i = 0; i < 5; ++i) {
    const Vector5 d = 1e-6 * Vector5::Unit(i);
    J.col(i) = (moved(d) - moved(-d)) / 2e-6;
  }
  DriftCovariance covariance(0.1, 0.3, 0.05);
  const Eigen::Matrix<double, 5, 5> before = covariance.joint();
  covariance.advance(step, 0.0);
  EXPECT_TRUE(covariance.joint().isApprox(J * before * J.transpose(), 1e-8));
}

TEST(DriftingOdometry, ItsIncrementsGiveItsCovariances) {
  const auto all = driven(bends(300), {.scale = 0.005, .yaw_walk = 1e-3});
  for (std::size_t i = 1; i < all.size(); ++i) {
    const Matrix6d before = all[i - 1].covariance.topLeftCorner<6, 6>();
    const Matrix6d now = all[i].covariance.topLeftCorner<6, 6>();
    const Matrix6d& Q = all[i].increment_covariance;
    const Matrix6d told = all[i].transition * before * all[i].transition.transpose() + Q;
    EXPECT_TRUE(told.isApprox(now, 1e-6)) << "frame " << i;
    EXPECT_GT(eigenvalues(Q).minCoeff(), -1e-12);
    EXPECT_FALSE(Q.isZero(0.0));
    EXPECT_GT(eigenvalues(all[i].covariance).minCoeff(), 0.0);
  }
}

TEST(DriftingOdometry, ABodyAtRestHasAnIncrementWithACovariance) {
  const replay::PoseFile still(replay::PoseFormat::kTum, {{stampAt(0).time, RigidTransform()},
                                                          {stampAt(1).time, RigidTransform()}});
  const auto all = driven(still, {});
  EXPECT_TRUE(all[1].has_increment);
  EXPECT_FALSE(all[1].increment_covariance.isZero(0.0)) << "the filter takes zero for not known";
}

/// Roll and pitch have no error, and height has almost none.
TEST(DriftingOdometry, TheErrorAtTheEndIsAsLargeAsItIsTold) {
  const auto truth = bends(300);
  constexpr int kSeeds = 200;
  sim::Dice dice(7);
  double sum = 0.0;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    DriftConfig config;
    config.scale_sigma = 0.005;
    config.scale = config.scale_sigma * dice.normal();
    config.seed = seed;
    const Odometry end = driven(truth, config).back();
    const auto error = boxMinus(truth.poses().back().T_WB, end.T_WB);
    const std::vector<Eigen::Index> counted{2, 3, 4};
    const Eigen::Vector3d e = error(counted);
    const Eigen::Matrix3d P = end.covariance(counted, counted);
    sum += squaredMahalanobis(e, P) / 3.0;
  }
  EXPECT_NEAR(sum / kSeeds, 1.0, 0.18) << "three deviations of the mean";
}

TEST(DriftingOdometry, TheSameSeedDrawsTheSame) {
  const auto truth = bends(50);
  const auto lastOf = [&](std::int64_t seed) { return driven(truth, {.seed = seed}).back().T_WB; };
  EXPECT_EQ(lastOf(1).p, lastOf(1).p);
  EXPECT_EQ(lastOf(1).q.coeffs(), lastOf(1).q.coeffs());
  EXPECT_NE(lastOf(1).p, lastOf(2).p);
}

TEST(DriftingOdometry, IsChosenByItsNameAndSetByItsKeys) {
  const auto root = replay::tinyEuroc("drifting");
  const auto bytesOf = [&](std::vector<std::string> keys, std::optional<std::int64_t> seed,
                           const std::string& out) {
    PipelineOptions options;
    options.data = root.string();
    options.odometry = "drifting";
    options.detections = "none";
    options.out = (root / out).string();
    options.assignments = std::move(keys);
    options.seed = seed;
    Pipeline pipeline(options);
    pipeline.run([](const PipelineCounts&) {});
    pipeline.finish();
    return replay::readText(root / out / "trajectory.tum") +
           replay::readText(root / out / "odometry.csv");
  };
  const std::string by_key = bytesOf({"drifting.scale=0.2", "drifting.seed=4"}, {}, "a");
  EXPECT_EQ(by_key, bytesOf({"drifting.scale=0.2"}, 4, "b"));
  EXPECT_NE(by_key, bytesOf({"drifting.scale=0.1"}, 4, "c"));
  EXPECT_THAT(replay::startupErrorOf([&] { bytesOf({"drifting.scale=2"}, {}, "d"); }),
              ::testing::HasSubstr("scale"));
}

}  // namespace
}  // namespace perdure::tools
