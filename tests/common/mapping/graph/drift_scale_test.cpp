#include "common/mapping/graph/drift_scale.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "common/mapping/frames/level_errors.h"

namespace perdure::mapping {
namespace {

Eigen::Matrix4d deviations(double plane, double height, double yaw) {
  return Eigen::Vector4d(plane * plane, plane * plane, height * height, yaw * yaw).asDiagonal();
}

/// A drive of three rounds of a square of 240 m, with odometry whose increments err.
class Drive {
 public:
  /// `scale`: true over assumed deviation in the plane; `height`: of heights.
  Drive(double scale, double height, std::uint32_t seed) : random_(seed) {
    Eigen::Matrix4d assumed = deviations(0.03, 0.05, 0.001);
    assumed(0, 0) = 0.07 * 0.07;  // along the way
    const DriftVariance factors{scale * scale, height * height};
    LevelPose by_odometry;
    true_.push_back({});
    way_.push_back(anchorAt({}, 0));
    for (int k = 1; k <= kAnchors; ++k) {
      const LevelPose step{{10.0, 0.0, 0.0}, k % 6 == 0 ? M_PI / 2 : 0.0};
      true_.push_back(true_.back() * step);
      const LevelPose measured = disturbed(step, factors.of(assumed));
      by_odometry = by_odometry * measured;
      way_.push_back(anchorAt(by_odometry, k));
      // Factors that are in use must not change the result.
      if (k % 2 == 0) way_.back().scale = {9.0, 4.0};
      way_.back().from_previous = {measured, way_.back().scale.of(assumed)};
    }
  }

  /// A loop between two anchors, measured with this covariance.
  Edge loop(int a, int b, const Eigen::Matrix4d& covariance) {
    const auto at = [](int k) { return static_cast<std::size_t>(k); };
    const LevelPose T_ab = true_[at(a)].inverse() * true_[at(b)];
    return {idOf(a), idOf(b), {disturbed(T_ab, covariance), covariance}, EdgeKind::kLoop};
  }
  /// Loops to the round before, from the end of the first round on.
  std::vector<Edge> loops(int n, const Eigen::Matrix4d& covariance) {
    std::vector<Edge> result;
    for (int k = 0; k < n; ++k) {
      const int b = kRound + (k * (kAnchors - kRound)) / std::max(1, n);
      result.push_back(loop(b - kRound, b, covariance));
    }
    return result;
  }
  const std::vector<Anchor>& way() const { return way_; }

  static constexpr int kRound = 24, kAnchors = 72;

 private:
  static AnchorId idOf(int k) { return static_cast<AnchorId>(k) + 5; }
  static Anchor anchorAt(const LevelPose& pose, int k) {
    Anchor anchor;
    anchor.id = idOf(k);
    anchor.T_WA = pose.rigid();
    anchor.way_m = 10.0 * k;
    return anchor;
  }
  LevelPose disturbed(LevelPose pose, const Eigen::Matrix4d& covariance) {
    const Eigen::Vector4d sigma = covariance.diagonal().cwiseSqrt();
    for (int i = 0; i < 3; ++i) pose.p[i] += sigma[i] * normal_(random_);
    pose.yaw += sigma[3] * normal_(random_);
    return pose;
  }

  std::mt19937 random_;
  std::normal_distribution<double> normal_;
  std::vector<LevelPose> true_;
  std::vector<Anchor> way_;
};

const Eigen::Matrix4d kMeasured = deviations(0.05, 0.05, 0.002);

DriftScale after(Drive drive, int loops, double apart_m = 10.0) {
  DriftScale drift({}, drive.way());
  EXPECT_EQ(drift.use(drive.loops(loops, kMeasured), apart_m), loops > 0);
  return drift;
}

TEST(DriftScale, ComesNearTheTrueOneByTwelveLoops) {
  for (const double scale : {0.1, 0.3, 1.0, 3.0, 10.0}) {
    double sum = 0.0;
    for (std::uint32_t seed = 1; seed <= 20; ++seed) {
      const DriftVariance found = after({scale, 1.0, seed}, 12).variance(0.5);
      EXPECT_GT(std::sqrt(found.plane), 0.4 * scale) << seed;
      EXPECT_LT(std::sqrt(found.plane), 2.5 * scale) << seed;
      sum += 0.5 * std::log(found.plane);
    }
    EXPECT_NEAR(sum / 20.0, std::log(scale), 0.2);
  }
}

/// Loops with the same increments have one error. If they counted as independent, the quantiles
/// would lie too close together.
TEST(DriftScale, HasItsQuantiles) {
  int below_lower = 0, above_upper = 0;
  constexpr int kRuns = 400;
  for (std::uint32_t seed = 1; seed <= kRuns; ++seed) {
    std::mt19937 random(seed);
    const double scale = std::exp(std::normal_distribution<double>()(random)) / 3.0;  // the prior
    const DriftScale drift = after({scale, 1.0, seed + 1000}, 6);
    if (scale * scale < drift.variance(0.2).plane) ++below_lower;
    if (scale * scale > drift.variance(0.8).plane) ++above_upper;
  }
  EXPECT_NEAR(below_lower, 0.2 * kRuns, 30);  // a step of the grid is 12 %
  EXPECT_NEAR(above_upper, 0.2 * kRuns, 30);
}

TEST(DriftScale, WithoutLoopsIsThePrior) {
  const DriftScale drift = after({1.0, 1.0, 1}, 0);
  EXPECT_NEAR(std::sqrt(drift.variance(0.5).height), 0.33, 0.05);
  EXPECT_NEAR(std::sqrt(drift.variance(0.8).plane), 0.77, 0.1);  // e^.84 / 3
  EXPECT_NEAR(std::sqrt(drift.variance(0.98).plane), 2.6, 0.35);
}

TEST(DriftScale, ALoopThatMeasuresNothingTellsNothing) {
  Drive drive(1.0, 1.0, 2);
  DriftScale drift({}, drive.way());
  const DriftVariance before = drift.variance(0.8);
  std::vector<Edge> loops = drive.loops(10, kMeasured);
  for (Edge& loop : loops) loop.T_ab.covariance = 1e8 * deviations(1.0, 1.0, 1.0);
  EXPECT_TRUE(drift.use(loops, 10.0));
  EXPECT_EQ(drift.variance(0.8), before);
}

TEST(DriftScale, LeavesOutEdgesOfOtherSessionsAndThoseBackwards) {
  Drive drive(1.0, 1.0, 3);
  DriftScale drift({}, drive.way());
  Edge other = drive.loop(0, Drive::kRound, kMeasured), back = other;
  other.a = 1;
  std::swap(back.a, back.b);
  EXPECT_FALSE(drift.use({other, back}, 10.0));
}

/// A poor loop that errs by two deviations, beside a good one in the same stretch, is not used.
TEST(DriftScale, UsesTheMostAccurateLoopOfAStretch) {
  Drive drive(0.3, 1.0, 4);
  const auto good = drive.loops(5, kMeasured);
  auto both = good;
  for (const Edge& loop : good) {
    Edge poor = loop;
    poor.T_ab.covariance = deviations(2.0, 2.0, 0.1);
    poor.T_ab.mean.p.x() += 4.0;
    both.push_back(poor);
  }
  DriftScale by_good({}, drive.way()), by_both({}, drive.way());
  by_good.use(good, 30.0);
  by_both.use(both, 30.0);
  EXPECT_EQ(by_both.variance(0.8), by_good.variance(0.8));
}

/// Without the others a wrong loop cannot be recognised; by them it is left out.
TEST(DriftScale, LeavesOutAWrongLoop) {
  for (std::uint32_t seed = 1; seed <= 10; ++seed) {
    Drive drive(0.3, 1.0, seed);
    auto loops = drive.loops(5, kMeasured);
    DriftScale sound({}, drive.way()), disturbed({}, drive.way()), alone({}, drive.way());
    sound.use(loops, 10.0);
    loops[2].T_ab.mean.p += Eigen::Vector3d(3.0, -2.0, 0.0);
    disturbed.use(loops, 10.0);
    alone.use({loops[2]}, 10.0);
    EXPECT_LT(disturbed.variance(0.8).plane, 2.0 * sound.variance(0.8).plane) << seed;
    EXPECT_GT(alone.variance(0.8).plane, 4.0 * sound.variance(0.8).plane) << seed;
  }
}

TEST(DriftScale, AHeightThatDriftsTellsNothingOfThePlane) {
  const DriftVariance level = after({0.5, 1.0, 5}, 8).variance(0.5),
                      climbing = after({0.5, 8.0, 5}, 8).variance(0.5);
  EXPECT_EQ(climbing.plane, level.plane);
  EXPECT_GT(climbing.height, 16.0);
  EXPECT_LT(level.height, 4.0);
  const DriftVariance both{4.0, 9.0};
  const Eigen::Matrix4d P = both.of(Eigen::Matrix4d::Ones());
  EXPECT_EQ(P(0, 0), 4.0);
  EXPECT_EQ(P(2, 2), 9.0);
  EXPECT_EQ(P(2, 3), 6.0);
  EXPECT_EQ(both.over(both), DriftVariance());
}

}  // namespace
}  // namespace perdure::mapping
