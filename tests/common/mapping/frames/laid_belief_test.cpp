#include "common/mapping/frames/laid_belief.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "common/math/gaussian.h"
#include "common/math/so3.h"

namespace perdure::mapping {
namespace {

template <class M>
M random(std::mt19937& generator, double deviation = 1.0) {
  std::normal_distribution<double> normal;
  return M::NullaryExpr([&] { return deviation * normal(generator); });
}

template <class M>
M covariance(std::mt19937& generator, double deviation) {
  const M root = random<M>(generator, deviation);
  return root * root.transpose() + 0.01 * deviation * deviation * M::Identity();
}

ObjectBelief car(std::uint32_t seed) {
  std::mt19937 generator(seed);
  ObjectBelief belief;
  belief.id = 7;
  belief.velocity = {3.0, -1.0, 0.0};
  belief.seen_from[0] = 10.0F, belief.seen_from[15] = 30.0F;
  for (const double probability : {0.7, 0.3}) {
    ClassBelief c;
    c.name = probability > 0.5 ? "car" : kOtherClass;
    c.probability = probability;
    c.mean << 20.0 + probability, -7.0, 0.8, 2.9, 1.4, 0.6, 0.4;
    c.covariance = covariance<Matrix7d>(generator, 0.3);
    c.cross_pose = random<Eigen::Matrix<double, 7, 6>>(generator, 0.1);
    belief.classes.push_back(c);
  }
  return belief;
}

const RigidTransform kTurn(rotationAboutZ(1.1), Eigen::Vector3d(40.0, -9.0, 1.3));

TEST(LaidBelief, WhatTheMapShowsOfItIsTurnedAsItsBestBeliefIs) {
  const ObjectBelief belief = car(2);
  MapObject object;
  object.world = {3, 1};
  object.mean = belief.best().mean;
  object.covariance = belief.best().covariance;
  const MapObject there = turned(kTurn, object);
  const ClassBelief best = turned(kTurn, belief).best();
  EXPECT_EQ(there.mean, best.mean);
  EXPECT_EQ(there.covariance, best.covariance);
  EXPECT_EQ(there.world, object.world);
  EXPECT_GT((there.covariance - object.covariance).norm(), 1e-3) << "covariances turn, too";
}

TEST(LaidBelief, IsTurnedAndTurnedBack) {
  const ObjectBelief before = car(1);
  const ObjectBelief there = turned(kTurn, before);
  const ObjectBelief back = turned(kTurn.inverse(), there);
  EXPECT_LT((back.velocity - before.velocity).norm(), 1e-12);
  EXPECT_EQ(there.seen_from[3], 10.0F) << "1.1 rad are three sectors, rounded";
  EXPECT_EQ(there.seen_from[2], 30.0F);
  EXPECT_EQ(back.seen_from, before.seen_from);
  for (std::size_t i = 0; i < 2; ++i) {
    const ClassBelief &a = before.classes[i], &b = back.classes[i], &t = there.classes[i];
    EXPECT_LT((a.mean - b.mean).norm(), 1e-12);
    EXPECT_LT((a.covariance - b.covariance).norm(), 1e-12);
    EXPECT_LT((a.cross_pose - b.cross_pose).norm(), 1e-12);
    EXPECT_LT((t.mean.head<3>() - kTurn * Eigen::Vector3d(a.mean.head<3>())).norm(), 1e-12);
    EXPECT_NEAR(wrapAngle(t.mean[3] - a.mean[3] - 1.1), 0.0, 1e-12);
    EXPECT_LE(std::abs(t.mean[3]), 3.1416) << "wrapped";
    EXPECT_EQ(t.mean.tail<3>(), a.mean.tail<3>());
    EXPECT_LT(
        (t.covariance.bottomRightCorner<4, 4>() - a.covariance.bottomRightCorner<4, 4>()).norm(),
        1e-12);
    EXPECT_GT((t.covariance - a.covariance).norm(), 0.01);
  }
}

/// In the pose error, θ stays in the body's axes and p rotates with W.
TEST(LaidBelief, TurnsItsCorrelationWithThePose) {
  std::mt19937 generator(3);
  const Matrix6d P = covariance<Matrix6d>(generator, 0.2);
  Matrix6d H = Matrix6d::Identity();
  H.bottomRightCorner<3, 3>() = kTurn.R();
  ObjectBelief belief = car(2);
  const auto explained = [](const ClassBelief& c, const Matrix6d& pose) {
    return Matrix7d(regressOn(pose, c.cross_pose) * c.cross_pose.transpose());
  };
  Matrix7d G = Matrix7d::Identity();
  G.topLeftCorner<3, 3>() = kTurn.R();
  const Matrix7d expected = G * explained(belief.best(), P) * G.transpose();
  const Matrix7d found = explained(turned(kTurn, belief).best(), H * P * H.transpose());
  EXPECT_LT((found - expected).norm(), 1e-9);
}

TEST(LaidBelief, RelativeToTheBodyIsWhatIsItsOwn) {
  std::mt19937 generator(5);
  ObjectBelief belief = car(4);
  const Matrix6d P = covariance<Matrix6d>(generator, 0.2);
  std::vector<Matrix7d> own;
  for (ClassBelief& c : belief.classes) {
    const auto A = random<Eigen::Matrix<double, 7, 6>>(generator);
    own.push_back(c.covariance);
    c.covariance += A * P * A.transpose();
    c.cross_pose = A * P;
  }
  const ObjectBelief relative = relativeToBody(belief, P);
  for (std::size_t i = 0; i < 2; ++i) {
    // The transform adds a variance of 1e-6 m².
    EXPECT_LT((relative.classes[i].covariance - own[i] - 1e-6 * Matrix7d::Identity()).norm(), 1e-9);
    EXPECT_EQ(relative.classes[i].cross_pose.norm(), 0.0);
    EXPECT_EQ(relative.classes[i].mean, belief.classes[i].mean);
  }
}

TEST(LaidBelief, OfAnUnknownPoseErrorKeepsItsCovariance) {
  const ObjectBelief belief = car(6);
  const ObjectBelief relative = relativeToBody(belief, Matrix6d::Zero());
  for (std::size_t i = 0; i < 2; ++i) {
    const Matrix7d& P = relative.classes[i].covariance;
    EXPECT_TRUE(isCovariance(P));
    EXPECT_LT((P - belief.classes[i].covariance).norm(), 1e-5);
    EXPECT_EQ(relative.classes[i].cross_pose.norm(), 0.0);
  }
}

TEST(LaidBelief, NeverBecomesLessThanACovariance) {
  ObjectBelief belief = car(7);
  for (ClassBelief& c : belief.classes) c.cross_pose *= 100.0;  // larger than the covariance allows
  for (const ClassBelief& c : relativeToBody(belief, Matrix6d::Identity()).classes) {
    EXPECT_TRUE(isCovariance(c.covariance));
  }
}

TEST(LaidBelief, TheErrorOfTheFrameTurnsAboutItsPlace) {
  const Eigen::Vector3d about(3.0, 4.0, 0.5);
  const ObjectBelief belief = car(8);
  // Moves the frame by [δp, δyaw], with the rotation about `about`.
  const auto moved = [&](const Eigen::Vector4d& d) {
    const Eigen::Matrix3d R = rotationAboutZ(d[3]);
    return turned(RigidTransform(R, about - R * about + d.head<3>()), belief);
  };
  constexpr double kStep = 1e-6;
  for (std::size_t i = 0; i < 2; ++i) {
    Eigen::Matrix4d J;
    for (int k = 0; k < 4; ++k) {
      const Eigen::Vector4d d = kStep * Eigen::Vector4d::Unit(k);
      J.col(k) = (moved(d).classes[i].mean - moved(-d).classes[i].mean).head<4>() / (2.0 * kStep);
    }
    std::mt19937 generator(9);
    const auto S = covariance<Eigen::Matrix4d>(generator, 0.1);
    Matrix7d expected = belief.classes[i].covariance;
    expected.topLeftCorner<4, 4>() += J * S * J.transpose();
    const ObjectBelief found = withFrameError(belief, S, about);
    EXPECT_LT((found.classes[i].covariance - expected).norm(), 1e-6);
    EXPECT_EQ(found.classes[i].mean, belief.classes[i].mean);
  }
}

}  // namespace
}  // namespace perdure::mapping
