#include "common/mapping/graph/marginals.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <map>

namespace perdure::mapping {
namespace {

Eigen::Matrix4d levelCovariance(double metres, double yaw) {
  return Eigen::Vector4d(metres * metres, metres * metres, metres * metres, yaw * yaw).asDiagonal();
}

const LevelGaussian kOnward{{{12.0, 1.0, 0.2}, 0.1}, levelCovariance(0.1, 0.002)};

PoseGraph chain(std::size_t anchors, const LevelGaussian& step = kOnward) {
  PoseGraph graph{{}};
  graph.addFirst(1, {{3.0, 4.0, 0.0}, 1.0});
  for (std::size_t i = 2; i <= anchors; ++i) graph.add(i, i - 1, step);
  return graph;
}

/// An edge that agrees with the anchors, with a different variance in each axis.
Edge loopBetween(const PoseGraph& graph, AnchorId a, AnchorId b) {
  Eigen::Matrix4d S = levelCovariance(0.2, 0.01);
  S(0, 1) = S(1, 0) = 0.01;
  S(1, 3) = S(3, 1) = 0.0005;
  S(2, 2) = 0.09;
  return {a, b, {graph.pose(a).inverse() * graph.pose(b), S}, EdgeKind::kLoop};
}

/// The term that the optimiser adds to the covariance of each edge.
Eigen::Matrix4d floorOfEdges() { return levelCovariance(1e-3, 1e-5); }

/// Derivatives of the error of T_AB with respect to the pose errors of A and of B.
struct Jacobians {
  Eigen::Matrix4d by_a, by_b;
};
Jacobians jacobians(const LevelPose& a, const LevelPose& b) {
  return {composedByFirst(a.inverse(), b) * invertedBy(a), composedBySecond(a.inverse())};
}

/// Covariance of T_from,to from the inverse of the complete normal equations, in which only the
/// first anchor is fixed.
Eigen::Matrix4d dense(const PoseGraph& graph, AnchorId from, AnchorId to) {
  std::map<AnchorId, Eigen::Index> rows;
  for (const auto& [id, pose] : graph.poses()) {
    const auto row = static_cast<Eigen::Index>(4 * rows.size());
    rows[id] = row;
  }
  const auto n = static_cast<Eigen::Index>(4 * rows.size());
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(n, n);
  for (const auto& [id, edge] : graph.edges()) {
    const Jacobians J = jacobians(graph.pose(edge.a), graph.pose(edge.b));
    Eigen::MatrixXd whole = Eigen::MatrixXd::Zero(4, n);
    whole.middleCols<4>(rows.at(edge.a)) = J.by_a;
    whole.middleCols<4>(rows.at(edge.b)) = J.by_b;
    H += graph.weight(id) * whole.transpose() * (edge.T_ab.covariance + floorOfEdges()).inverse() *
         whole;
  }
  Eigen::MatrixXd S = Eigen::MatrixXd::Zero(n, n);
  S.bottomRightCorner(n - 4, n - 4) = H.bottomRightCorner(n - 4, n - 4).inverse();
  const Jacobians J = jacobians(graph.pose(from), graph.pose(to));
  Eigen::MatrixXd whole = Eigen::MatrixXd::Zero(4, n);
  whole.middleCols<4>(rows.at(from)) = J.by_a;
  whole.middleCols<4>(rows.at(to)) = J.by_b;
  return whole * S * whole.transpose();
}

/// Difference relative to the sizes of position and yaw.
double relative(const Eigen::Matrix4d& a, const Eigen::Matrix4d& b) {
  const Eigen::Matrix4d off = a - b;
  return std::max(off.norm() / b.norm(), std::abs(off(3, 3)) / b(3, 3));
}

TEST(Marginals, VariancesOfAllAnchorsAreThoseOfEach) {
  PoseGraph graph = chain(40);
  for (const AnchorId a : {2, 5, 9, 11, 17}) graph.add(loopBetween(graph, a, 40 - a));
  const LevelPose elsewhere{{500.0, 0.0, 0.0}, -1.0};
  graph.addFirst(50, elsewhere);  // an anchor of another component
  graph.add(51, 50, kOnward);
  graph.holdFirstAnchors();
  const auto all = Marginals(graph, 7).variances();
  ASSERT_EQ(all.size(), graph.poses().size());
  for (const AnchorId first : {AnchorId(1), AnchorId(50)}) {
    const Marginals from_first(graph, first);
    for (const auto& [id, pose] : graph.poses()) {
      const auto known = from_first.to(id);
      if (!known) continue;
      Eigen::Matrix4d G = Eigen::Matrix4d::Identity();
      G.topLeftCorner<3, 3>() = graph.pose(first).R();
      const Eigen::Vector4d expected = (G * known->covariance * G.transpose()).diagonal();
      for (int i = 0; i < 4; ++i) {
        EXPECT_NEAR(all.at(id)[i], expected[i], 1e-9 * expected[i] + 1e-15) << id << " " << i;
      }
    }
  }
  EXPECT_GT(all.at(51)[0], 0.005);
}

TEST(Marginals, AreTheDenseInverseOfTheSameNormalEquations) {
  PoseGraph graph = chain(14);
  graph.add(loopBetween(graph, 2, 9));
  graph.add(loopBetween(graph, 4, 14));
  graph.add(loopBetween(graph, 5, 12));
  for (const AnchorId from : {14, 7, 1}) {
    const Marginals marginals(graph, from);
    for (const auto& [id, pose] : graph.poses()) {
      const auto known = marginals.to(id);
      ASSERT_TRUE(known) << from << " " << id;
      EXPECT_LT(difference(known->mean, graph.pose(from).inverse() * pose).norm(), 1e-9);
      if (id == from) continue;
      const Eigen::Matrix4d expected = dense(graph, from, id);
      EXPECT_LT(relative(known->covariance, expected), 1e-9) << from << " " << id;
    }
  }
}

TEST(Marginals, ComposeAlongAChainWithoutLoops) {
  LevelGaussian step = kOnward;
  const PoseGraph graph = chain(9, step);
  step.covariance += floorOfEdges();
  LevelGaussian expected;
  for (int i = 0; i < 8; ++i) expected = compose(expected, step);
  const auto forward = Marginals(graph, 1).to(9);
  ASSERT_TRUE(forward);
  EXPECT_LT(difference(forward->mean, expected.mean).norm(), 1e-9);
  EXPECT_LT(relative(forward->covariance, expected.covariance), 1e-9);
  const auto backward = Marginals(graph, 9).to(1);
  ASSERT_TRUE(backward);
  EXPECT_LT(difference(backward->mean, inverse(expected).mean).norm(), 1e-9);
  EXPECT_LT(relative(backward->covariance, inverse(expected).covariance), 1e-9);
  // Compares also two anchors of which neither is the fixed one.
  LevelGaussian part;
  for (int i = 0; i < 3; ++i) part = compose(part, step);
  const auto middle = Marginals(graph, 4).to(7);
  ASSERT_TRUE(middle);
  EXPECT_LT(relative(middle->covariance, part.covariance), 1e-9);
}

TEST(Marginals, AreNothingAtTheirBeginning) {
  const PoseGraph graph = chain(3);
  for (const AnchorId id : {1, 2}) {
    const auto self = Marginals(graph, id).to(id);
    ASSERT_TRUE(self);
    EXPECT_EQ(self->covariance.norm(), 0.0);
    EXPECT_LT(difference(self->mean, {}).norm(), 1e-12);
  }
}

TEST(Marginals, OfTwoIndependentWaysAreTighterThanTheBetterOne) {
  PoseGraph graph = chain(2, {{{10.0, 0.0, 0.0}, 0.0}, levelCovariance(0.3, 0.01)});
  const double one = Marginals(graph, 1).to(2)->covariance(0, 0);
  const LevelPose apart = graph.pose(1).inverse() * graph.pose(2);
  graph.add({1, 2, {apart, levelCovariance(0.4, 0.02)}, EdgeKind::kLoop});
  const Eigen::Matrix4d two = Marginals(graph, 1).to(2)->covariance;
  EXPECT_NEAR(one, 0.09, 1e-5);
  EXPECT_NEAR(two(0, 0), 1.0 / (1.0 / 0.09 + 1.0 / 0.16), 1e-5);
  EXPECT_NEAR(two(3, 3), 1.0 / (1.0 / 1e-4 + 1.0 / 4e-4), 1e-8);
}

TEST(Marginals, KnowWhatALoopMeasures) {
  PoseGraph graph = chain(60);
  const double along = Marginals(graph, 60).to(1)->covariance.trace();
  EXPECT_GT(along, 1.0);
  const LevelPose apart = graph.pose(60).inverse() * graph.pose(1);
  graph.add({60, 1, {apart, levelCovariance(0.05, 0.001)}, EdgeKind::kLoop});
  const Marginals marginals(graph, 60);
  const double closed = marginals.to(1)->covariance.trace();
  EXPECT_LT(closed, 3.0 * 0.051 * 0.051);
  EXPECT_GT(closed, 3.0 * 0.04 * 0.04);
  // The far side of the loop has the largest variance. The loop closure makes it much smaller than
  // without.
  const double half = marginals.to(30)->covariance.trace();
  EXPECT_GT(half, 10.0 * closed);
  EXPECT_LT(half, 0.5 * Marginals(chain(60), 60).to(30)->covariance.trace());
}

TEST(Marginals, DoNotCountALoopThatTheOptimiserDoesNotBelieve) {
  PoseGraph graph = chain(20);
  const Eigen::Matrix4d along = Marginals(graph, 1).to(20)->covariance;
  LevelPose apart = graph.pose(1).inverse() * graph.pose(20);
  apart.p.x() += 100.0;
  const EdgeId wrong = graph.add({1, 20, {apart, levelCovariance(0.05, 0.001)}, EdgeKind::kLoop});
  graph.optimise();
  ASSERT_LT(graph.weight(wrong), kBelieved);
  EXPECT_NEAR(Marginals(graph, 1).to(20)->covariance.trace(), along.trace(), 0.02 * along.trace());
}

TEST(Marginals, SayNothingOfWhatCannotBeReached) {
  PoseGraph graph = chain(5);
  graph.addFirst(100, {});
  graph.add(101, 100, kOnward);
  const Marginals marginals(graph, 5);
  EXPECT_TRUE(marginals.to(1));
  EXPECT_FALSE(marginals.to(100));
  EXPECT_FALSE(marginals.to(101));
  EXPECT_FALSE(marginals.to(555));
  EXPECT_FALSE(Marginals(graph, 555).to(1));
  // Two fixed anchors are not related to each other by being fixed.
  EXPECT_FALSE(Marginals(graph, 1).to(100));
  EXPECT_LT(relative(Marginals(graph, 100).to(101)->covariance,
                     compose({}, {kOnward.mean, kOnward.covariance + floorOfEdges()}).covariance),
            1e-9);
}

TEST(Marginals, OfOneAnchorAlone) {
  const PoseGraph graph = chain(1);
  const Marginals marginals(graph, 1);
  EXPECT_TRUE(marginals.to(1));
  EXPECT_FALSE(marginals.to(2));
}

/// The loop closure between two sessions was removed. Until the graph is optimised, nothing
/// constrains the second session.
TEST(Marginals, TellNothingWhereTheyCannotBeComputed) {
  PoseGraph graph = chain(3);
  graph.addFirst(10, {{50.0, 0.0, 0.0}, 0.0});
  const EdgeId loop = graph.add(loopBetween(graph, 2, 10));
  (void)graph.optimise();
  EXPECT_EQ(Marginals(graph, 3).variances().size(), 4u);
  graph.remove(loop);
  const Marginals marginals(graph, 3);
  const auto variances = marginals.variances();
  ASSERT_EQ(variances.size(), 1u);
  EXPECT_EQ(variances.at(1), Eigen::Vector4d::Zero()) << "it is held fast";
  EXPECT_FALSE(marginals.to(1).has_value());
  EXPECT_EQ(marginals.to(3)->covariance, Eigen::Matrix4d::Zero()) << "relative to itself";
}

}  // namespace
}  // namespace perdure::mapping
