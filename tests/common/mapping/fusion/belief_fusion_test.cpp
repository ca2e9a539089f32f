#include "common/mapping/fusion/belief_fusion.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "common/math/gaussian.h"
#include "common/math/so3.h"

namespace perdure::mapping {
namespace {

Matrix7d covariance(double scale) {
  Vector7d d;
  d << 0.2, 0.3, 0.1, 0.1, 0.05, 0.05, 0.04;
  Matrix7d P = (scale * d.array().square()).matrix().asDiagonal();
  P(0, 1) = P(1, 0) = 0.3 * std::sqrt(P(0, 0) * P(1, 1));
  return P;
}

ObjectBelief carAt(const Eigen::Vector3d& p, double scale = 1.0) {
  ObjectBelief belief;
  belief.id = 4;
  belief.existence = 0.9;
  belief.confirmed = true;
  belief.first_seen = fromNanoseconds(1'000);
  belief.last_seen = belief.as_of = fromNanoseconds(9'000);
  belief.hits = 12;
  ClassBelief car;
  car.name = "car";
  car.probability = 0.8;
  car.mean << p, 0.4, std::log(4.2), std::log(1.8), std::log(1.5);
  car.covariance = covariance(scale);
  ClassBelief van = car;
  van.name = "van";
  van.probability = 0.2;
  van.mean[6] += 0.3;
  belief.classes = {car, van};
  belief.why.existence.resize(kExistenceEvidences);
  belief.why.existence[1] = {logOdds(0.9), 12, belief.first_seen, belief.last_seen};
  belief.why.classes = {{"car", {std::log(0.8)}}, {"van", {std::log(0.2)}}};
  return belief;
}

double sumOf(const std::vector<double>& nats) {
  double sum = 0.0;
  for (const double each : nats) sum += each;
  return sum;
}

void expectLedgerSums(const ObjectBelief& belief) {
  EXPECT_NEAR(belief.why.logOdds(), logOdds(belief.existence), 1e-9);
  for (const ClassBelief& c : belief.classes) {
    const auto of = std::find_if(belief.why.classes.begin(), belief.why.classes.end(),
                                 [&](const ClassLedger& l) { return l.name == c.name; });
    ASSERT_NE(of, belief.why.classes.end()) << c.name;
    EXPECT_NEAR(sumOf(of->log_odds), std::log(c.probability), 1e-9) << c.name;
  }
}

TEST(BeliefFusion, OfABeliefWithItselfIsItself) {
  const ObjectBelief car = carAt({3, 4, 1});
  const ObjectBelief same = fused(car, car);
  EXPECT_NEAR(same.existence, car.existence, 1e-12);
  EXPECT_EQ(same.hits, car.hits);
  ASSERT_EQ(same.classes.size(), car.classes.size());
  for (std::size_t k = 0; k < car.classes.size(); ++k) {
    EXPECT_EQ(same.classes[k].name, car.classes[k].name);
    EXPECT_NEAR(same.classes[k].probability, car.classes[k].probability, 1e-12);
    EXPECT_TRUE(same.classes[k].mean.isApprox(car.classes[k].mean, 1e-9));
    EXPECT_TRUE(same.classes[k].covariance.isApprox(car.classes[k].covariance, 1e-9));
  }
  expectLedgerSums(same);
}

TEST(BeliefFusion, TakesTheEarlierTheLaterAndTheLarger) {
  ObjectBelief a = carAt({3, 4, 1}), b = carAt({3.1, 4, 1}, 2.0);
  b.first_seen = fromNanoseconds(100);
  b.last_seen = fromNanoseconds(5'000);
  b.hits = 40;
  a.seen_from[1] = 20.0F, b.seen_from[1] = 10.0F, b.seen_from[2] = 5.0F;
  b.existence = 0.99;
  const ObjectBelief both = fused(a, b);
  EXPECT_EQ(both.id, a.id);
  EXPECT_EQ(both.first_seen, b.first_seen);
  EXPECT_EQ(both.last_seen, a.last_seen);
  EXPECT_EQ(both.hits, 40u);
  EXPECT_EQ(both.seen_from[1], 20.0F);
  EXPECT_EQ(both.seen_from[2], 5.0F);
  EXPECT_GE(both.existence, a.existence - 1e-12);
  EXPECT_LE(both.existence, b.existence + 1e-12);
  expectLedgerSums(both);
}

TEST(BeliefFusion, NeitherVetoesAClassThatItDoesNotConsider) {
  ObjectBelief a = carAt({3, 4, 1}), b = carAt({3.1, 4, 1});
  b.classes[1].name = "truck";
  b.why.classes[1].name = "truck";
  const ObjectBelief both = fused(a, b);
  ASSERT_EQ(both.classes.size(), 3u);
  EXPECT_EQ(both.best().name, "car");
  double sum = 0.0;
  for (const ClassBelief& c : both.classes) {
    EXPECT_GT(c.probability, 0.0) << c.name;
    sum += c.probability;
  }
  EXPECT_NEAR(sum, 1.0, 1e-12);
  expectLedgerSums(both);
}

/// The same car in two sessions with different frames and anchors.
TEST(BeliefFusion, AcrossFramesWhatIsTheSameStaysWhereItIs) {
  Anchor home, away;
  home.T_WA = {rotationAboutZ(0.3), {10, 2, 0.5}};
  away.T_WA = {rotationAboutZ(-1.1), {-4, 7, 0}};
  const LevelPose T_ha{{6, -3, 0.2}, 0.9};
  const ObjectBelief at_home = carAt({14, 5, 1});
  ObjectRecord record;
  const Witness host{at_home, record, home};
  ObjectBelief at_away = at_home;
  const RigidTransform T = away.T_WA * T_ha.inverse().rigid() * home.T_WA.inverse();
  for (ClassBelief& c : at_away.classes) {
    c.mean.head<3>() = (T * Eigen::Vector3d(c.mean.head<3>())).eval();
    c.mean[3] = wrapAngle(c.mean[3] + yawOf(T.R()));
    Matrix7d G = Matrix7d::Identity();
    G.topLeftCorner<3, 3>() = T.R();
    c.covariance = (G * c.covariance * G.transpose()).eval();
  }
  const Witness guest{at_away, record, away};
  const ObjectBelief both = fusedAcross(host, guest, {T_ha, Eigen::Matrix4d::Zero()});
  EXPECT_TRUE(both.best().mean.isApprox(at_home.best().mean, 1e-9));
  EXPECT_LT((both.best().covariance - at_home.best().covariance).norm(), 1e-5);
  // An uncertain relation of the frames carries little information.
  const LevelGaussian vague{T_ha, 100.0 * Eigen::Matrix4d::Identity()};
  const ObjectBelief alone = fusedAcross(host, guest, vague);
  EXPECT_LT((alone.best().covariance.topLeftCorner<4, 4>() -
             at_home.best().covariance.topLeftCorner<4, 4>())
                .norm(),
            0.05);
}

/// Fusion does not reduce the pose error in the host's covariance, because the guest has no
/// information about it.
TEST(BeliefFusion, KeepsTheErrorOfTheHostsPose) {
  Anchor anchor;
  ObjectBelief car = carAt({3, 4, 1});
  ObjectRecord record;
  record.pose_error = 0.5 * Matrix6d::Identity();
  Eigen::Matrix<double, 7, 6> B = Eigen::Matrix<double, 7, 6>::Zero();
  B.block<3, 3>(0, 3).setIdentity();
  for (ClassBelief& c : car.classes) {
    c.cross_pose = B * record.pose_error;
    c.covariance += B * record.pose_error * B.transpose();
  }
  const Witness witness{car, record, anchor};
  const ObjectBelief both = fusedAcross(witness, witness, LevelGaussian());
  EXPECT_LT((both.best().covariance - car.best().covariance).norm(), 1e-5);
  EXPECT_TRUE(both.best().cross_pose.isApprox(car.best().cross_pose, 1e-9));
}

}  // namespace
}  // namespace perdure::mapping
