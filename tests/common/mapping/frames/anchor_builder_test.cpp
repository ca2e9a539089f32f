#include "common/mapping/frames/anchor_builder.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "common/math/gaussian.h"
#include "common/math/so3.h"

namespace perdure::mapping {
namespace {

Odometry at(std::uint64_t sequence, const Eigen::Vector3d& p, double yaw = 0.0) {
  Odometry o;
  o.stamp.sequence = sequence;
  o.world = {7, 2};
  o.state = OdometryState::kTracking;
  o.T_WB = RigidTransform(rotationAboutZ(yaw), p);
  return o;
}

std::vector<Anchor> anchorsOf(AnchorBuilder& builder, const std::vector<Odometry>& drive) {
  std::vector<Anchor> anchors;
  for (const Odometry& o : drive) {
    if (auto anchor = builder.add(o, anchors.size() + 1)) anchors.push_back(*anchor);
  }
  return anchors;
}

TEST(AnchorBuilder, SetsAnAnchorEveryTwelveMetresOfAStraight) {
  AnchorBuilder builder{{}};
  std::vector<Odometry> drive;
  for (int i = 0; i <= 125; ++i) drive.push_back(at(i, {0.8 * i, 0.0, 0.0}));
  const auto anchors = anchorsOf(builder, drive);
  ASSERT_EQ(anchors.size(), 9u);
  EXPECT_EQ(anchors[0].previous, 0u);
  EXPECT_EQ(anchors[0].session, (WorldId{7, 2}));
  for (std::size_t i = 1; i < anchors.size(); ++i) {
    EXPECT_EQ(anchors[i].previous, i);
    EXPECT_NEAR(anchors[i].from_previous.mean.p.x(), 12.0, 1e-9);
    EXPECT_NEAR(anchors[i].way_m, 12.0 * static_cast<double>(i), 1e-9);
    EXPECT_TRUE(isCovariance(anchors[i].from_previous.covariance));
  }
  EXPECT_NEAR(builder.way_m(), 100.0, 1e-9);
  EXPECT_NEAR(builder.sinceLast()->mean.p.x(), 4.0, 1e-9);
}

TEST(AnchorBuilder, SetsNoneWhileTheOdometryInitialises) {
  AnchorBuilder builder{{}};
  Odometry o = at(1, {0.0, 0.0, 0.0});
  o.state = OdometryState::kInitialising;
  EXPECT_FALSE(builder.add(o, 1));
  EXPECT_FALSE(builder.sinceLast());
  o.state = OdometryState::kDegraded;
  EXPECT_TRUE(builder.add(o, 1));
  EXPECT_TRUE(builder.sinceLast());
}

TEST(AnchorBuilder, SetsNoneAtRestHoweverLongAndNoisy) {
  AnchorBuilder builder{{}};
  std::mt19937 random(1);
  std::normal_distribution<double> noise(0.0, 0.001);
  int anchors = 0;
  for (int i = 0; i < 20'000; ++i) {
    const Eigen::Vector3d p(noise(random), noise(random), noise(random));
    anchors += builder.add(at(i, p, 0.6 * std::sin(0.01 * i)), 1) ? 1 : 0;
  }
  EXPECT_EQ(anchors, 1);
  EXPECT_EQ(builder.way_m(), 0.0);
}

TEST(AnchorBuilder, CountsTheWayOfABodyThatCreeps) {
  AnchorBuilder builder{{}};
  for (int i = 0; i <= 20'000; ++i) builder.add(at(i, {0.0005 * i, 0.0, 0.0}), 1);
  EXPECT_NEAR(builder.way_m(), 10.0, 0.03);
}

TEST(AnchorBuilder, SetsOneAfterATurnOfThirtyDegrees) {
  AnchorBuilder builder{{}};
  std::vector<Odometry> drive;
  for (int i = 0; i <= 40; ++i) {
    const double yaw = 0.05 * i;  // a circle with a radius of two metres
    drive.push_back(at(i, {2.0 * std::sin(yaw), 2.0 - 2.0 * std::cos(yaw), 0.0}, yaw));
  }
  const auto anchors = anchorsOf(builder, drive);
  ASSERT_EQ(anchors.size(), 4u);
  for (std::size_t i = 1; i < 4; ++i) EXPECT_NEAR(anchors[i].from_previous.mean.yaw, 0.55, 1e-9);
}

TEST(AnchorBuilder, SetsOneWhereYawGetsUncertain) {
  AnchorParameters parameters;
  parameters.walk_yaw = 0.0015;  // exceeds 0.0026 rad after three metres
  AnchorBuilder builder(parameters);
  std::vector<Odometry> drive;
  for (int i = 0; i <= 100; ++i) drive.push_back(at(i, {0.1 * i, 0.0, 0.0}));
  const auto anchors = anchorsOf(builder, drive);
  ASSERT_EQ(anchors.size(), 4u);
  EXPECT_NEAR(anchors[1].from_previous.mean.p.x(), 3.1, 1e-9);
}

TEST(AnchorBuilder, AWalkActsThroughTheLeverArm) {
  AnchorParameters parameters;
  parameters.distance_m = 100.0;
  parameters.yaw_sigma_rad = 1.0;
  AnchorBuilder builder(parameters);
  for (int i = 0; i <= 1000; ++i) builder.add(at(i, {0.05 * i, 0.0, 0.0}), 1);
  const Eigen::Matrix4d P = builder.sinceLast()->covariance;
  const double metres = 50.0, yaw = parameters.walk_yaw * parameters.walk_yaw;
  const double position = parameters.walk_position * parameters.walk_position;
  EXPECT_NEAR(P(3, 3), metres * yaw, 1e-9);
  EXPECT_NEAR(P(0, 0), metres * position, 1e-6);
  EXPECT_NEAR(P(1, 1), metres * position + metres * metres * metres * yaw / 3.0, 1e-3 * P(1, 1));
  EXPECT_NEAR(P(1, 3), metres * metres * yaw / 2.0, 2e-3 * P(1, 3));
}

/// A drive as the odometry reports it, with errors drawn from several models.
class Errors {
 public:
  /// Errors decay by the factor `kept` in each step. New errors have the deviations `tilt`, `yaw`,
  /// `position`.
  Errors(double kept, double tilt, double yaw, double position) {
    const double kStep = 0.4;
    double heading = 0.3;
    Eigen::Vector3d p(10.0, -20.0, 1.0);
    Matrix6d P = Matrix6d::Zero();
    P.diagonal() << 1e-6, 1e-6, 1e-4, 4.0, 4.0, 1.0;
    for (int i = 0; i < 120; ++i) {
      Odometry o = at(i, p, heading);
      o.T_WB.q =
          o.T_WB.q * expQuaternion({0.05 * std::sin(0.3 * i), 0.04 * std::cos(0.2 * i), 0.0});
      if (i > 0) {
        const Eigen::Matrix3d R = o.T_WB.R(), R_before = drive.back().T_WB.R();
        o.transition.topLeftCorner<3, 3>() = R.transpose() * R_before;
        o.transition.bottomLeftCorner<3, 3>() = -skew(p - drive.back().T_WB.p) * R_before;
        o.transition *= kept;
        Eigen::Matrix<double, 6, 1> sigma;
        sigma << R.transpose() * Eigen::Vector3d(tilt, tilt, yaw),
            Eigen::Vector3d::Constant(position);
        o.increment_covariance = sigma.cwiseAbs2().asDiagonal();
        o.has_increment = true;
        o.increment_from = i - 1;
        P = (o.transition * P * o.transition.transpose() + o.increment_covariance).eval();
      }
      o.covariance.topLeftCorner<6, 6>() = P;
      drive.push_back(o);
      heading += 0.03 * std::sin(0.05 * i);
      p += kStep * Eigen::Vector3d(std::cos(heading), std::sin(heading), 0.02);
    }
  }

  /// The true pose of the body at each frame.
  std::vector<RigidTransform> truth(std::mt19937& random) const {
    std::vector<RigidTransform> poses;
    Eigen::Matrix<double, 6, 1> e = draw(drive[0].covariance.topLeftCorner<6, 6>(), random);
    for (std::size_t i = 0; i < drive.size(); ++i) {
      if (i > 0) e = (drive[i].transition * e + draw(drive[i].increment_covariance, random)).eval();
      poses.push_back(boxPlus(drive[i].T_WB, e));
    }
    return poses;
  }

  std::vector<Odometry> drive;

 private:
  static Eigen::Matrix<double, 6, 1> draw(const Matrix6d& P, std::mt19937& random) {
    std::normal_distribution<double> normal;
    Eigen::Matrix<double, 6, 1> z;
    for (double& value : z) value = normal(random);
    return P.diagonal().cwiseSqrt().cwiseProduct(z);
  }
};

/// Mean of the normalised squared errors of the first increment between anchors.
double meanNees(const Errors& errors) {
  AnchorBuilder builder{{}};
  const auto anchors = anchorsOf(builder, errors.drive);
  const LevelGaussian told = anchors.at(1).from_previous;
  const std::size_t end = anchors[1].stamp.sequence;
  std::mt19937 random(11);
  constexpr int kRuns = 4000;
  double sum = 0.0;
  for (int run = 0; run < kRuns; ++run) {
    const auto truth = errors.truth(random);
    const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
    const LevelPose T = levelOf(levelled(truth[0], up).inverse() * levelled(truth[end], up));
    sum += squaredMahalanobis(difference(T, told.mean), told.covariance) / kRuns;
  }
  return sum;
}

constexpr double kBand = 3.3 * 0.0447;  // deviation of the mean of 4,000 draws from χ² with 4
                                        // degrees of freedom: √(8 / 4000)

TEST(AnchorBuilder, TellsTheErrorOfAWalkThatIncrementsDescribe) {
  EXPECT_NEAR(meanNees(Errors(1.0, 0.0, 0.0005, 0.005)), 4.0, kBand);
}

TEST(AnchorBuilder, TellsTheErrorOfAnOdometryThatTakesErrorsBack) {
  EXPECT_NEAR(meanNees(Errors(0.98, 0.0005, 0.002, 0.02)), 4.0, kBand);
}

TEST(AnchorBuilder, DoesNotCountWhatItWasOffByBefore) {
  AnchorBuilder builder{{}};
  const auto anchors = anchorsOf(builder, Errors(1.0, 0.0, 0.0005, 0.005).drive);
  const Eigen::Matrix4d P = anchors.at(1).from_previous.covariance;
  EXPECT_LT(P.diagonal().head(3).sum(), 0.01);
}

TEST(AnchorBuilder, TakesTheWalkWhereAnIncrementIsMissing) {
  Errors errors(1.0, 0.0, 0.0005, 0.005);
  AnchorBuilder whole{{}}, broken{{}};
  for (std::size_t i = 0; i < 20; ++i) {
    whole.add(errors.drive[i], 1);
    if (i < 10 || i > 14) broken.add(errors.drive[i], 1);
  }
  const Eigen::Matrix4d a = whole.sinceLast()->covariance, b = broken.sinceLast()->covariance;
  const double metres = 6 * 0.4, walk = AnchorParameters().walk_yaw;
  EXPECT_TRUE(isCovariance(b));
  EXPECT_NEAR(b(3, 3), 13.0 / 19.0 * a(3, 3) + metres * walk * walk, 1e-3 * b(3, 3));
}

}  // namespace
}  // namespace perdure::mapping
