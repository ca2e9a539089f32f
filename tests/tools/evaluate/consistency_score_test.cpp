#include "tools/evaluate/consistency_score.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "common/math/so3.h"
#include "tests/common/replay/tiny_datasets.h"

namespace perdure::tools {
namespace {

sim::TruthObject chairAt(std::uint64_t id, double x) {
  sim::TruthObject chair;
  chair.id = id;
  chair.class_name = chair.looks_like = "chair";
  chair.size = Eigen::Vector3d(0.5, 0.5, 0.9);
  chair.present_from = TimePoint::min(), chair.present_until = TimePoint::max();
  chair.keys = {{fromNanoseconds(0), Eigen::Vector3d(x, 2, 0.45), 0.3}};
  return chair;
}

/// Returns a correct estimate of the object.
MapBelief beliefOf(const sim::TruthObject& object, double sigma) {
  MapBelief belief;
  belief.id = object.id;
  belief.class_name = object.class_name;
  belief.existence = 0.9;
  belief.mean << object.keys[0].centre_W, object.keys[0].yaw,
      Eigen::Vector3d(object.size.array().log());
  belief.covariance = sigma * sigma * Matrix7d::Identity();
  return belief;
}

TEST(Consistency, HonestCovariancesHaveAneesOneAndStayInTheBand) {
  std::mt19937_64 random(7);
  std::normal_distribution<double> normal;
  sim::Truth truth;
  std::vector<MapBelief> beliefs;
  for (std::uint64_t i = 1; i <= 300; ++i) {
    truth.objects.push_back(chairAt(i, 10.0 * static_cast<double>(i)));
    beliefs.push_back(beliefOf(truth.objects.back(), 0.1));
    for (Eigen::Index k = 0; k < 7; ++k) beliefs.back().mean[k] += 0.1 * normal(random);
  }
  const auto score = scoreConsistency(beliefs, truth, RigidTransform(), 3.0);
  EXPECT_EQ(score.objects, 300U);
  for (const Anees* anees : {&score.position, &score.yaw, &score.half_yaw, &score.size}) {
    EXPECT_GT(anees->mean(), anees->band().first) << anees->what;
    EXPECT_LT(anees->mean(), anees->band().second) << anees->what;
    EXPECT_GT(anees->within3Sigma(), 0.98) << anees->what;
  }
  for (auto& belief : beliefs) belief.covariance *= 0.25;  // half of the true standard deviation
  EXPECT_NEAR(scoreConsistency(beliefs, truth, RigidTransform(), 3.0).position.mean(),
              4.0 * score.position.mean(), 1e-9);
}

TEST(Consistency, RunsCountAsOneEach) {
  RunAnees runs{"position", 3, {}};
  runs.add({"position", 3, {1.5, 1.5, 1.5}});  // 0.5 per degree of freedom
  runs.add({"position", 3, {4.5}});
  runs.add({"position", 3, {}});
  ASSERT_EQ(runs.means.size(), 2U) << "a run without objects says nothing";
  EXPECT_DOUBLE_EQ(runs.mean(), 1.0);
  EXPECT_DOUBLE_EQ(runs.standardError(), 0.5);
  EXPECT_LT(runs.band().first, 0.25) << "two runs of three degrees";
  EXPECT_GT(runs.band().second, 2.0);
}

TEST(Consistency, TheTruthIsTakenIntoTheMapsWorld) {
  const RigidTransform T_WT(rotationAboutZ(1.2), Eigen::Vector3d(5, -3, 1));
  sim::Truth truth;
  truth.objects = {chairAt(1, 10.0)};
  MapBelief belief = beliefOf(truth.objects[0], 0.1);
  belief.mean.head<3>() = T_WT * truth.objects[0].keys[0].centre_W;
  belief.mean[3] += 1.2;
  const auto score = scoreConsistency({belief}, truth, T_WT, 3.0);
  EXPECT_NEAR(score.position.mean(), 0.0, 1e-12);
  EXPECT_NEAR(score.yaw.mean(), 0.0, 1e-12);
  EXPECT_EQ(scoreConsistency({belief}, truth, RigidTransform(), 3.0).objects, 0U);
}

TEST(Consistency, AChairTheWrongWayRoundIsWrongInYawButNotInItsHalfTurn) {
  sim::Truth truth;
  truth.objects = {chairAt(1, 10.0)};
  MapBelief belief = beliefOf(truth.objects[0], 0.1);
  belief.mean[3] += std::numbers::pi - 0.05;
  const auto score = scoreConsistency({belief}, truth, RigidTransform(), 3.0);
  EXPECT_GT(score.yaw.mean(), 900.0);
  EXPECT_NEAR(score.half_yaw.mean(), 0.25, 1e-9);
}

TEST(Consistency, OnlyTheNearestStandingBeliefOfTheClassIsCompared) {
  sim::Truth truth;
  truth.objects = {chairAt(1, 10.0), chairAt(2, 20.0)};
  truth.objects[1].moves = true;
  std::vector<MapBelief> beliefs(5, beliefOf(truth.objects[0], 0.1));
  beliefs[0].mean[0] += 0.5;
  beliefs[1].mean[0] += 0.2;
  beliefs[2].class_name = "couch";
  beliefs[3].moving = 0.9;
  beliefs[4].mean[0] = 20.0;
  const auto score = scoreConsistency(beliefs, truth, RigidTransform(), 3.0);
  ASSERT_EQ(score.objects, 1U);
  EXPECT_NEAR(score.position.mean(), 4.0 / 3.0, 1e-9) << "0.2 m at 0.1 m";
  EXPECT_EQ(score.left_out, 4U);
}

/// A body that circles with its x axis upwards, so that its yaw is undefined.
RigidTransform circling(double t) {
  const Eigen::Matrix3d up = expSo3(Eigen::Vector3d(0, -0.5 * std::numbers::pi, 0));
  return {rotationAboutZ(0.3 * t) * up,
          Eigen::Vector3d(5 * std::cos(0.3 * t), 5 * std::sin(0.3 * t), 1)};
}

replay::PoseFile circle() {
  std::vector<replay::StampedPose> poses;
  for (int i = 0; i < 4000; ++i) {
    poses.push_back({fromNanoseconds(5'000'000LL * i), circling(0.005 * i)});
  }
  return {replay::PoseFormat::kTum, poses};
}

/// Odometry in a rotated and shifted world, with errors of sigma; the first row of an epoch has no
/// error.
std::vector<OdometryRow> odometryOf(double sigma, double turn) {
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  std::vector<OdometryRow> rows;
  for (int i = 10; i < 390; ++i) {
    OdometryRow row;
    row.time = fromNanoseconds(50'000'000LL * i);
    row.epoch = i < 200 ? 0 : 1;
    const bool first = i == 10 || i == 200;
    const auto error = [&]() -> Eigen::Vector3d {
      return Eigen::Vector3d(normal(random), normal(random), normal(random)) *
             (first ? 0.0 : sigma);
    };
    const auto epoch = static_cast<double>(row.epoch);
    const RigidTransform W(rotationAboutZ(turn * epoch), Eigen::Vector3d(epoch, -7, 2));
    const double t = 0.05 * i, h = 1e-4;
    row.T_WB = W * circling(t);
    row.v_WB = W.R() * (circling(t + h).p - circling(t - h).p) / (2.0 * h) + error();
    row.T_WB = RigidTransform(row.T_WB.R() * expSo3(error()), row.T_WB.p + error());
    row.covariance = sigma * sigma * Matrix9d::Identity();
    rows.push_back(row);
  }
  return rows;
}

TEST(Consistency, HonestOdometryHasAneesOneInEachEpochsWorld) {
  const auto score = scoreOdometry(odometryOf(0.01, 2.0), circle());
  for (const Anees* anees : {&score.orientation, &score.position, &score.velocity}) {
    EXPECT_EQ(anees->nees.size(), 380U) << anees->what;
    EXPECT_GT(anees->mean(), anees->band().first) << anees->what;  // errors are independent for
                                                                   // each row
    EXPECT_LT(anees->mean(), anees->band().second) << anees->what;
  }
  auto fast = odometryOf(0.01, 2.0);
  for (OdometryRow& row : fast) row.v_WB *= 1.05;  // 7.5 cm/s
  EXPECT_NEAR(scoreOdometry(fast, circle()).velocity.mean(), 1.0 + 7.5 * 7.5 / 3.0, 2.0);
}

TEST(Consistency, AFileThatIsNoneIsRefusedWithTheFix) {
  const auto folder = replay::freshFolder("consistency");
  const auto errorOf = [&] {
    return replay::startupErrorOf([&] { readBeliefs(folder / "objects.json"); });
  };
  EXPECT_THAT(errorOf(), testing::HasSubstr("perdure pipeline"));
  replay::writeText(folder / "objects.json", R"({"objects": [{"id": 1}]})");
  EXPECT_THAT(errorOf(), testing::HasSubstr("class"));
  EXPECT_EQ(replay::startupCodeOf([&] { readBeliefs(folder / "objects.json"); }), ExitCode::kData);
  replay::writeText(folder / "odometry.csv", "frame,timestamp_ns\n3,4,oops\n");
  EXPECT_THAT(replay::startupErrorOf([&] { readOdometry(folder / "odometry.csv"); }),
              testing::HasSubstr("odometry.csv:2"));
}

}  // namespace
}  // namespace perdure::tools
