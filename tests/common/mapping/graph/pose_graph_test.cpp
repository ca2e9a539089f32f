#include "common/mapping/graph/pose_graph.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "common/mapping/graph/edge_cost.h"
#include "common/math/chi2.h"
#include "common/math/numeric_jacobian.h"
#include "common/math/so3.h"

namespace perdure::mapping {
namespace {

using std::numbers::pi;

constexpr std::size_t kAnchors = 120;
constexpr double kStep_m = 12.0;

Eigen::Matrix4d diagonal(double metres, double yaw) {
  return Eigen::Vector4d(metres * metres, metres * metres, metres * metres, yaw * yaw).asDiagonal();
}

class Dice {
 public:
  explicit Dice(std::uint32_t seed) : random_(seed) {}
  LevelPose off(const LevelPose& pose, double metres, double yaw) {
    const Eigen::Vector3d step(normal_(random_), normal_(random_), normal_(random_));
    return {pose.p + metres * step, wrapAngle(pose.yaw + yaw * normal_(random_))};
  }

 private:
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
};

/// Two laps of a circle: anchor i + 60 has the same position as anchor i.
LevelPose truth(std::size_t i) {
  const double angle = 2.0 * pi * static_cast<double>(i) / 60.0;
  const double radius = 60.0 * kStep_m / (2.0 * pi);
  return {{radius * std::sin(angle), radius - radius * std::cos(angle), 0.0}, wrapAngle(angle)};
}

LevelPose trueStep(std::size_t a, std::size_t b) { return truth(a).inverse() * truth(b); }

constexpr double kMetres = 0.1, kYaw = 0.004;
constexpr double kLoopMetres = 0.15, kLoopYaw = 0.01;

/// Anchors 1 to kAnchors from odometry with the declared errors.
PoseGraph drive(Dice& dice, const GraphParameters& parameters = {}) {
  PoseGraph graph(parameters);
  graph.addFirst(1, truth(0));
  for (std::size_t i = 1; i < kAnchors; ++i) {
    graph.add(i + 1, i, {dice.off(trueStep(i - 1, i), kMetres, kYaw), diagonal(kMetres, kYaw)});
  }
  return graph;
}

Edge loop(Dice& dice, std::size_t a, std::size_t b) {
  return {a + 1,
          b + 1,
          {dice.off(trueStep(a, b), kLoopMetres, kLoopYaw), diagonal(kLoopMetres, kLoopYaw)},
          EdgeKind::kLoop};
}

double worstError(const PoseGraph& graph) {
  double worst = 0.0;
  for (const auto& [id, pose] : graph.poses()) {
    worst = std::max(worst, (pose.p - truth(id - 1).p).norm());
  }
  return worst;
}

TEST(EdgeCost, JacobianMatchesTheNumericOne) {
  std::mt19937 random(4);
  std::normal_distribution<double> normal;
  for (int i = 0; i < 20; ++i) {
    LevelGaussian T_ab{{{5.0, -3.0, 1.0}, 2.0}, Eigen::Matrix4d::Random()};
    T_ab.covariance = (T_ab.covariance * T_ab.covariance.transpose()).eval();
    T_ab.covariance.diagonal().array() += 0.1;
    const EdgeCost cost(T_ab);
    Eigen::VectorXd x(8);
    for (double& value : x) value = 3.0 * normal(random);
    x[7] = x[3] + 2.0 + 0.5 * normal(random);
    const auto f = [&](const Eigen::VectorXd& at) -> Eigen::VectorXd {
      Eigen::Vector4d residual;
      const double* parameters[] = {at.data(), at.data() + 4};
      cost.Evaluate(parameters, residual.data(), nullptr);
      return residual;
    };
    Eigen::Matrix<double, 4, 4, Eigen::RowMajor> J_a, J_b;
    Eigen::Vector4d residual;
    const double* parameters[] = {x.data(), x.data() + 4};
    double* jacobians[] = {J_a.data(), J_b.data()};
    cost.Evaluate(parameters, residual.data(), jacobians);
    const Eigen::MatrixXd J = numericJacobian(f, x);
    EXPECT_LT((J.leftCols<4>() - J_a).norm(), 1e-6 * J.norm());
    EXPECT_LT((J.rightCols<4>() - J_b).norm(), 1e-6 * J.norm());
  }
}

TEST(EdgeCost, IsChiSquaredOfTheMeasuredTransform) {
  LevelGaussian T_ab{{{5.0, -3.0, 1.0}, 3.1}, diagonal(0.5, 0.1)};
  PoseGraph graph{{}};
  graph.addFirst(1, {{100.0, 50.0, 0.0}, 0.3});
  graph.add(2, 1, T_ab);
  EXPECT_NEAR(graph.chi2({1, 2, T_ab}), 0.0, 1e-18);
  T_ab.mean.p.x() += 1.0;
  T_ab.mean.yaw = wrapAngle(T_ab.mean.yaw + 0.2);
  EXPECT_NEAR(graph.chi2({1, 2, T_ab}), 8.0, 1e-4);
}

TEST(ScalingLoss, IsContinuousWithItsSlopeAndHasABound) {
  const double kernel = 13.3;
  const ScalingLoss loss(kernel);
  double below[3], above[3];
  loss.Evaluate(kernel * (1.0 - 1e-9), below);
  loss.Evaluate(kernel * (1.0 + 1e-9), above);
  EXPECT_NEAR(below[0], above[0], 1e-6);
  EXPECT_NEAR(below[1], above[1], 1e-6);
  for (const double chi2 : {0.1, 5.0, 14.0, 40.0, 1e3, 1e6}) {
    double rho[3], less[3], more[3];
    const double step = 1e-5 * chi2;
    loss.Evaluate(chi2, rho);
    loss.Evaluate(chi2 - step, less);
    loss.Evaluate(chi2 + step, more);
    EXPECT_NEAR((more[0] - less[0]) / (2.0 * step), rho[1], 1e-6);
    EXPECT_NEAR((more[1] - less[1]) / (2.0 * step), rho[2], 1e-6);
    EXPECT_EQ(loss.weight(chi2), rho[1]);
    EXPECT_LE(rho[0], 3.0 * kernel);
    // Agarwal's switch variable.
    EXPECT_NEAR(std::sqrt(rho[1]), std::min(1.0, 2.0 * kernel / (kernel + chi2)), 1e-12);
  }
}

TEST(PoseGraph, AChainStaysWhereOdometryPutsIt) {
  Dice dice(5);
  PoseGraph graph = drive(dice);
  const auto before = graph.poses();
  const OptimiseReport report = graph.optimise();
  EXPECT_TRUE(report.converged);
  EXPECT_LT(report.largest_move_m, 1e-9);
  EXPECT_NEAR(report.cost, 0.0, 1e-9);
  EXPECT_THAT(report.weights, testing::IsEmpty());
}

TEST(PoseGraph, LoopsTakeTheDriftOut) {
  Dice dice(6);
  PoseGraph graph = drive(dice);
  const double drifted = worstError(graph);
  std::vector<EdgeId> loops;
  for (std::size_t i = 0; i < 60; i += 5) loops.push_back(graph.add(loop(dice, i, i + 60)));
  const OptimiseReport report = graph.optimise();
  EXPECT_TRUE(report.converged);
  EXPECT_EQ(difference(graph.pose(1), truth(0)).norm(), 0.0);
  EXPECT_LT(worstError(graph), 0.6 * drifted);
  for (std::size_t i = 0; i < 60; i += 5) {
    const LevelPose apart = graph.pose(i + 1).inverse() * graph.pose(i + 61);
    EXPECT_LT((apart.p - trueStep(i, i + 60).p).norm(), 0.5);
  }
  for (const EdgeId id : loops) EXPECT_EQ(report.weights.at(id), graph.weight(id));
}

TEST(PoseGraph, CostIsChiSquaredOfTheRedundantMeasurements) {
  double sum = 0.0;
  constexpr int kRuns = 60, kLoops = 12;
  GraphParameters parameters;
  parameters.kernel = 1e6;
  for (std::uint32_t seed = 0; seed < kRuns; ++seed) {
    Dice dice(100 + seed);
    PoseGraph graph = drive(dice, parameters);
    for (std::size_t i = 0; i < kLoops; ++i) graph.add(loop(dice, 5 * i, 5 * i + 60));
    sum += graph.optimise().cost;
  }
  const int dof = 4 * kLoops * kRuns;
  EXPECT_GT(sum, chi2Quantile(0.001, dof));
  EXPECT_LT(sum, chi2Quantile(0.999, dof));
}

TEST(PoseGraph, AWrongLoopAmongGoodOnesMovesLittle) {
  Dice dice(7);
  PoseGraph graph = drive(dice);
  for (std::size_t i = 0; i < 60; i += 5) graph.add(loop(dice, i, i + 60));
  graph.optimise();
  const auto before = graph.poses();
  Edge wrong = loop(dice, 22, 82);
  wrong.T_ab.mean.p += Eigen::Vector3d(15.0, -8.0, 0.0);
  const EdgeId id = graph.add(wrong);
  EXPECT_EQ(graph.weight(id), 1.0);
  const OptimiseReport report = graph.optimise();
  EXPECT_LT(report.weights.at(id), 0.01);
  EXPECT_GT(report.chi2.at(id), 1e3);
  EXPECT_LT(report.largest_move_m, 0.05);
  graph.remove(id);
  graph.optimise();
  for (const auto& [anchor, pose] : before) {
    EXPECT_LT((graph.pose(anchor).p - pose.p).norm(), 0.01);
  }
}

/// Each step has a yaw error of half a deviation: 27 m at the end.
PoseGraph drifted() {
  PoseGraph graph{{}};
  graph.addFirst(1, truth(0));
  for (std::size_t i = 1; i < kAnchors; ++i) {
    LevelPose step = trueStep(i - 1, i);
    step.yaw += 0.5 * kYaw;
    graph.add(i + 1, i, {step, diagonal(kMetres, kYaw)});
  }
  return graph;
}

TEST(PoseGraph, ATrueLoopAfterMuchDriftIsTaken) {
  Dice dice(8);
  PoseGraph graph = drifted();
  EXPECT_GT(worstError(graph), 25.0);
  const EdgeId id = graph.add(loop(dice, 0, 119));
  const OptimiseReport report = graph.optimise();
  EXPECT_GT(report.weights.at(id), 0.9);
  EXPECT_LT((graph.pose(120).p - truth(119).p).norm(), 1.0);
}

TEST(PoseGraph, TrueLoopsAfterMuchDriftAreToldFromWrongOnes) {
  Dice dice(9);
  PoseGraph graph = drifted();
  std::vector<EdgeId> right, wrong;
  for (const std::size_t i : {2, 12, 25, 40, 52}) right.push_back(graph.add(loop(dice, i, i + 60)));
  for (const std::size_t i : {8, 30}) {
    Edge edge = loop(dice, i, i + 60);
    edge.T_ab.mean.p += Eigen::Vector3d(9.0, -6.0, 0.0);
    wrong.push_back(graph.add(edge));
  }
  const OptimiseReport report = graph.optimise();
  for (const EdgeId id : right) EXPECT_GT(report.weights.at(id), 0.5);
  for (const EdgeId id : wrong) EXPECT_LT(report.weights.at(id), 0.1);
}

TEST(PoseGraph, AComponentThatIsJoinedMovesAndTheOlderOneStays) {
  Dice dice(9);
  PoseGraph graph = drive(dice);
  graph.addFirst(1000, {{5.0, 5.0, 0.0}, 1.0});
  graph.add(1001, 1000, {{{12.0, 0.0, 0.0}, 0.0}, diagonal(kMetres, kYaw)});
  graph.holdFirstAnchors();
  EXPECT_TRUE(graph.isHeldFast(1) && graph.isHeldFast(1000));
  graph.add(
      {10, 1000, {{{1.0, 2.0, 0.0}, 0.5}, diagonal(kLoopMetres, kLoopYaw)}, EdgeKind::kTracking});
  // A distant anchor is first moved to its place, because the kernel would reject the edge
  // otherwise.
  graph.setPose(1000, graph.pose(10) * LevelPose{{1.5, 2.0, 0.0}, 0.5});
  const OptimiseReport report = graph.optimise();
  EXPECT_EQ(report.weights.size(), 1u);
  EXPECT_LT(difference(graph.pose(10).inverse() * graph.pose(1000), {{1.0, 2.0, 0.0}, 0.5}).norm(),
            1e-4);
  EXPECT_LT(
      difference(graph.pose(1000).inverse() * graph.pose(1001), {{12.0, 0.0, 0.0}, 0.0}).norm(),
      1e-4);
  EXPECT_EQ(difference(graph.pose(1), truth(0)).norm(), 0.0);
  EXPECT_FALSE(graph.isHeldFast(1000));
  graph.remove(report.weights.begin()->first);
  graph.holdFirstAnchors();
  EXPECT_TRUE(graph.isHeldFast(1000)) << "it hangs together with nothing again";
}

TEST(PoseGraph, GoesOnFromWhatWasSaved) {
  Dice dice(10);
  PoseGraph graph = drifted();
  const EdgeId id = graph.add(loop(dice, 0, 119));
  graph.optimise();
  PoseGraph again{GraphParameters()};
  for (const auto& [edge_id, edge] : graph.edges()) {
    again.restore(edge_id, edge, graph.weight(edge_id));
  }
  for (const auto& [anchor, pose] : graph.poses()) again.addFirst(anchor, pose);
  again.holdFirstAnchors();
  EXPECT_FALSE(again.isNew(id));
  EXPECT_EQ(again.add(loop(dice, 1, 118)), graph.add(loop(dice, 1, 118)));
  again.remove(graph.edges().rbegin()->first);
  const OptimiseReport report = again.optimise();
  EXPECT_LT(report.largest_move_m, 1e-4);
}

TEST(PoseGraph, ALoopThatNoDriftExplainsIsLeftAlone) {
  Dice dice(11);
  PoseGraph graph = drive(dice);
  Edge wrong = loop(dice, 0, 60);
  wrong.T_ab.mean.p.z() += 30.0;
  const EdgeId id = graph.add(wrong);
  EXPECT_TRUE(graph.isNew(id));
  const OptimiseReport report = graph.optimise();
  EXPECT_FALSE(graph.isNew(id));
  EXPECT_LT(report.weights.at(id), 0.01);
  EXPECT_LT(report.largest_move_m, 0.05);
}

TEST(PoseGraph, TakesCovariancesThatAreSingular) {
  PoseGraph graph{{}};
  graph.addFirst(1, {});
  graph.add(2, 1, {{{1.0, 0.0, 0.0}, 0.0}, Eigen::Matrix4d::Zero()});
  graph.add(3, 2, {{{1.0, 0.0, 0.0}, 0.0}, Eigen::Matrix4d::Zero()});
  graph.add({1, 3, {{{2.001, 0.0, 0.0}, 0.0}, diagonal(0.01, 0.01)}});
  EXPECT_TRUE(graph.optimise().converged);
  EXPECT_NEAR(graph.pose(3).p.x(), 2.0, 1e-3);
}

}  // namespace
}  // namespace perdure::mapping
