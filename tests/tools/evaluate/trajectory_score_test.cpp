#include "tools/evaluate/trajectory_score.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/math/so3.h"

namespace perdure::tools {
namespace {

/// A loop of 40 m radius at 10 m/s, 10 Hz, in W with z up.
std::vector<PosePair> loop(std::size_t count) {
  std::vector<PosePair> pairs;
  for (std::size_t i = 0; i < count; ++i) {
    const double s = 0.025 * static_cast<double>(i);
    PosePair pair;
    pair.time = fromNanoseconds(static_cast<std::int64_t>(i) * 100'000'000);
    pair.truth = RigidTransform(rotationAboutZ(s),
                                {40 * std::sin(s), 40 * (1 - std::cos(s)), 0.2 * std::sin(3 * s)});
    pair.estimate = pair.truth;
    pairs.push_back(pair);
  }
  return pairs;
}

TEST(TrajectoryScore, AShiftAndAYawAreAlignedAway) {
  const RigidTransform T_EG(rotationAboutZ(1.1), {5, -3, 2});
  auto pairs = loop(100);
  for (auto& pair : pairs) pair.estimate = T_EG * pair.truth;
  for (const auto alignment : {Alignment::kYaw, Alignment::kRigid}) {
    const auto s = scoreTrajectory(pairs, alignment);
    EXPECT_LT(s.ate_rmse_m, 1e-9);
    EXPECT_LT(s.ate_rotation_deg, 1e-6);
    EXPECT_LT(s.rpe_m, 1e-9);
    EXPECT_LT(s.end_drift_m, 1e-9);
  }
}

TEST(TrajectoryScore, AlignedAtTheStartOnlyTheFirstPoseLies) {
  auto pairs = loop(100);
  const RigidTransform T_EG(rotationAboutZ(1.1), {5, -3, 2});
  for (auto& pair : pairs) pair.estimate = T_EG * pair.truth;
  EXPECT_LT(scoreTrajectory(pairs, Alignment::kStart).ate_rmse_m, 1e-9);
  for (std::size_t i = 1; i < pairs.size(); ++i) pairs[i].estimate.p.z() += 2.0;
  const auto s = scoreTrajectory(pairs, Alignment::kStart);
  EXPECT_NEAR(s.ate_rmse_m, 2.0 * std::sqrt(0.99), 1e-9);
  EXPECT_LT(scoreTrajectory(pairs, Alignment::kYaw).ate_rmse_m, 0.3);
}

TEST(TrajectoryScore, ATiltIsAlignedAwayOnlyByARigidAlignment) {
  const RigidTransform tilt(expQuaternion({0.05, 0, 0}), Eigen::Vector3d::Zero());
  auto pairs = loop(200);
  for (auto& pair : pairs) pair.estimate = tilt * pair.truth;
  EXPECT_GT(scoreTrajectory(pairs, Alignment::kYaw).ate_rmse_m, 0.5);
  EXPECT_LT(scoreTrajectory(pairs, Alignment::kRigid).ate_rmse_m, 1e-9);
}

TEST(TrajectoryScore, AnAlternatingErrorOfFiveCentimetresIsTheAte) {
  auto pairs = loop(100);
  for (std::size_t i = 0; i < pairs.size(); ++i)
    pairs[i].estimate.p.z() += i % 2 == 0 ? 0.05 : -0.05;
  const auto s = scoreTrajectory(pairs, Alignment::kYaw);
  EXPECT_NEAR(s.ate_rmse_m, 0.05, 1e-6);
  EXPECT_NEAR(s.ate_max_m, 0.05, 1e-6);
  EXPECT_NEAR(s.rpe_m, 0.0, 1e-9) << "ten steps later the error is the same";
}

TEST(TrajectoryScore, OnePercentOfScaleIsOnePercentOfSegmentError) {
  auto pairs = loop(1500);
  for (auto& pair : pairs) pair.estimate.p *= 1.01;
  const auto s = scoreTrajectory(pairs, Alignment::kYaw);
  EXPECT_EQ(s.segments.lengths_m.front(), 100.0);
  EXPECT_GT(s.segments.segments, 1000U);
  // A chord of the loop is shorter than its arc, so that the error is below 1 % of the arc.
  EXPECT_GT(s.segments.t_err_percent, 0.05);
  EXPECT_LT(s.segments.t_err_percent, 1.0);
  EXPECT_NEAR(s.segments.r_err_deg_per_m, 0.0, 1e-6);
}

TEST(TrajectoryScore, AYawDriftShowsInTheRotationOfSegments) {
  auto pairs = loop(400);
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const double yaw = 0.001 * static_cast<double>(i);  // per metre, because a frame is one metre
    pairs[i].estimate.q = pairs[i].truth.q * expQuaternion({0, 0, yaw});
  }
  const auto s = scoreTrajectory(pairs, Alignment::kYaw);
  EXPECT_NEAR(s.segments.r_err_deg_per_m, 0.001 * 180 / 3.14159265, 2e-3);
  EXPECT_NEAR(s.rpe_deg, 0.01 * 180 / 3.14159265, 1e-6);
}

TEST(TrajectoryScore, ABodyThatStandsStillIsAlignedByItsAttitude) {
  auto pairs = loop(50);
  for (auto& pair : pairs) {
    pair.truth = RigidTransform(rotationAboutZ(2.0), {1, 2, 3});
    pair.estimate = RigidTransform(rotationAboutZ(0.3), {0, 0, 0});
  }
  pairs.back().estimate.p.x() = 0.04;
  const auto s = scoreTrajectory(pairs, Alignment::kYaw);
  EXPECT_LT(s.ate_rotation_deg, 1e-6);
  EXPECT_NEAR(s.end_drift_m, 0.04, 1e-9);
}

}  // namespace
}  // namespace perdure::tools
