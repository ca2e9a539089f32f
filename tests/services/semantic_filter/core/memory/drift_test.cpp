// What returning objects say of the pose error.
#include "services/semantic_filter/core/memory/drift.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "common/math/gaussian.h"
#include "common/math/so3.h"
#include "tests/services/semantic_filter/scene.h"

namespace perdure::semantic_filter {
namespace {

using testing::makeCamera;
using testing::makeObject;
using testing::makeState;

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kRotationWalk = 0.0005, kPositionWalk = 0.02, kMetres = 400.0;
constexpr DriftParameters kParameters;

Matrix6d walked() {
  Matrix6d P = Matrix6d::Zero();
  P.diagonal() << Eigen::Vector3d::Constant(kMetres * kRotationWalk * kRotationWalk),
      Eigen::Vector3d::Constant(kMetres * kPositionWalk * kPositionWalk);
  return P;
}

const RigidTransform kSaid(Eigen::Quaterniond(Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitZ())),
                           {12.0, -7.0, 1.2});

/// A street ahead, as known from earlier visits, observed from the true place of the body.
struct Street {
  explicit Street(std::uint32_t seed) : random(seed) {
    std::uniform_real_distribution<double> any(0.0, 1.0);
    for (std::size_t i = 0; i < 12; ++i) {
      const Eigen::Vector3d place(8.0 + 16.0 * any(random), -6.0 + 12.0 * any(random), -0.45);
      State x = makeState(0, 0, 0, 0.4, 4.2, 1.75, 1.5);
      x.head<3>() = kSaid * place;
      truth.push_back(x);
    }
  }

  double noise(double sigma) { return sigma * std::normal_distribution<double>()(random); }

  std::vector<DriftMeasurement> looks(const RigidTransform& T_WB, double known_to) {
    const CameraModel camera{makeCamera()};
    const Matrix6d P_pose = walked();
    std::vector<DriftMeasurement> result;
    for (const State& x : truth) {
      const auto seen = projectCuboid(x, Projector(View{&camera, T_WB}));
      if (!seen) continue;
      BoxMeasurement z;
      for (int side = 0; side < 4; ++side) {
        z.sides[side] = seen->sides[side] + noise(2.0);
        z.variance[side] = 4.0;
      }
      Track thing = makeObject(1, "car", x, 0.0);
      Hypothesis& h = thing.hypotheses[0];
      h.P.setZero();
      h.P.topLeftCorner<3, 3>().diagonal().setConstant(known_to * known_to);
      for (int axis = 0; axis < 3; ++axis) h.x[axis] += noise(known_to);
      const auto expected = projectCuboid(h.x, Projector(View{&camera, kSaid}));
      if (!expected) continue;
      if (const auto told = driftMeasurement(h, *expected, z, {}, P_pose)) result.push_back(*told);
    }
    return result;
  }

  std::mt19937 random;
  std::vector<State> truth;
};

DriftEstimator driven() {
  DriftEstimator watch(kParameters);
  for (int i = 0; i < 400; ++i) {  // there and back, so that yaw alone does not carry it away
    const Eigen::Vector3d a(0.0, 0.0, 0.0), b(i % 2 == 0 ? 1.0 : -1.0, 0.0, 0.0);
    watch.predict(RigidTransform(Eigen::Quaterniond::Identity(), a),
                  RigidTransform(Eigen::Quaterniond::Identity(), b), kRotationWalk, kPositionWalk);
  }
  return watch;
}

PoseError poseError() {
  PoseError error;
  error.covariance = walked();
  return error;
}

RigidTransform truly(double yaw, const Eigen::Vector3d& p) {
  Vector6d error;
  error << 0.0, 0.0, yaw, p;
  return boxPlus(kSaid, error);
}

TEST(DriftEstimator, ReturningObjectsGiveThePoseOfTheBodyAndItsCovariance) {
  double squared = 0.0, corrected = 0.0;
  for (int run = 1; run <= 60; ++run) {
    Street street(static_cast<std::uint32_t>(run));
    const RigidTransform truth =
        truly(street.noise(0.57 * kDegree), {street.noise(0.4), street.noise(0.4), 0.0});
    DriftEstimator watch = driven();
    watch.add(street.looks(truth, 0.15), kSaid);
    const Matrix6d before = walked();
    const auto correction = watch.correct(kSaid, poseError());
    if (!correction) continue;  // the error may be small by chance
    const Vector6d left = boxMinus(truth, correction->step * kSaid);
    EXPECT_LT(left.tail<3>().norm(), 0.35) << run;
    EXPECT_LT(std::abs(left[2]), 1.2 * kDegree) << run;
    EXPECT_LT(eigenvalues(before - correction->after).maxCoeff(), before.maxCoeff());
    Eigen::Vector4d error = left.tail<4>();
    squared += squaredMahalanobis(error, correction->after.bottomRightCorner<4, 4>()) / 4.0;
    corrected += 1.0;
    EXPECT_FALSE(watch.correct(kSaid, poseError())) << "it is taken out once";
  }
  EXPECT_GE(corrected, 30.0);
  EXPECT_GT(squared / corrected, 0.5);
  EXPECT_LT(squared / corrected, 1.5);
}

TEST(DriftEstimator, AnErrorThatIsSmallOrUncertainOrOfFewObjectsIsNotRemoved) {
  Street street(3);
  DriftEstimator in_place = driven();
  in_place.add(street.looks(kSaid, 0.05), kSaid);
  EXPECT_FALSE(in_place.correct(kSaid, poseError()));
  const RigidTransform truth = truly(0.0, {0.4, -0.5, 0.0});
  DriftEstimator few = driven();
  auto looks = street.looks(truth, 0.05);
  ASSERT_GE(looks.size(), 5u);
  looks.resize(static_cast<std::size_t>(kParameters.things) - 1);
  few.add(looks, kSaid);
  EXPECT_FALSE(few.correct(kSaid, poseError()));
  DriftEstimator unsure = driven();
  unsure.add(street.looks(truth, 1.0), kSaid);
  EXPECT_FALSE(unsure.correct(kSaid, poseError()));
  DriftEstimator unmoved(kParameters);  // the pose has no error yet
  unmoved.add(street.looks(truth, 0.05), kSaid);
  EXPECT_FALSE(unmoved.correct(kSaid, poseError()));
}

/// The place is correlated with the pose error as that of a track that was just initiated.
CrossPose bornFrom(const RigidTransform& T_WB, const Eigen::Vector3d& place) {
  CrossPose B = CrossPose::Zero();
  B.topLeftCorner<3, 3>() = -skew(place - T_WB.p) * T_WB.R();
  B.block<3, 3>(0, 3).setIdentity();
  B.row(kYaw).head<3>() = T_WB.R().row(2);
  return B;
}

Hypothesis aCar() {
  State x = makeState(0, 0, 0, 0.4, 4.2, 1.75, 1.5);
  x.head<3>() = kSaid * Eigen::Vector3d(15.0, 2.0, -0.45);
  return makeObject(1, "car", x, 0.04).hypotheses[0];
}

/// For a box with an error of so many pixels.
std::optional<DriftMeasurement> toldBy(const Hypothesis& h, double pixels) {
  const CameraModel camera{makeCamera()};
  const auto predicted = projectCuboid(h.x, Projector(View{&camera, kSaid}));
  if (!predicted) return std::nullopt;
  BoxMeasurement z;
  z.sides = predicted->sides.array() + pixels;
  z.variance.setConstant(4.0);
  return driftMeasurement(h, *predicted, z, {}, walked());
}

TEST(DriftEstimator, AnObjectInitiatedUnderTheSameErrorGivesNoInformation) {
  Hypothesis h = aCar();
  const auto known = toldBy(h, 3.0);
  const CrossPose B = bornFrom(kSaid, h.x.head<3>());
  h.C = B * walked();
  h.P += B * walked() * B.transpose();
  const auto initiated = toldBy(h, 3.0);
  ASSERT_TRUE(known && initiated);
  const Eigen::Matrix<double, 4, 4> a = known->information.bottomRightCorner<4, 4>(),
                                    b = initiated->information.bottomRightCorner<4, 4>();
  EXPECT_LT(b.norm(), 1e-6 * a.norm());
  EXPECT_LT(initiated->pull.tail<4>().norm(), 1e-3 * known->pull.tail<4>().norm());
}

TEST(DriftEstimator, OutliersAreRefused) {
  EXPECT_TRUE(toldBy(aCar(), 3.0));
  EXPECT_FALSE(toldBy(aCar(), 150.0));
}

TEST(DriftEstimator, AnObjectInitiatedWithTheErrorMovesWithThePoseAndAnOlderOneStays) {
  Street street(5);
  const RigidTransform truth = truly(1.2 * kDegree, {0.5, -0.4, 0.0});
  DriftEstimator watch = driven();
  watch.add(street.looks(truth, 0.05), kSaid);
  const auto correction = watch.correct(kSaid, poseError());
  ASSERT_TRUE(correction);
  const State x = makeState(20, -3, 0.75, 0.4, 4.2, 1.75, 1.5);
  Track old = makeObject(1, "car", x, 0.04), young = old;
  young.hypotheses[0].C = bornFrom(kSaid, x.head<3>()) * walked();
  applyCorrection(old, *correction, poseError());
  applyCorrection(young, *correction, poseError());
  EXPECT_EQ(old.best().x, x);
  const RigidTransform corrected = correction->step * kSaid;
  const Eigen::Vector3d before = kSaid.inverse() * Eigen::Vector3d(x.head<3>());
  const Eigen::Vector3d after = corrected.inverse() * Eigen::Vector3d(young.best().x.head<3>());
  EXPECT_LT((after - before).norm(), 0.02);
  EXPECT_NEAR(wrapAngle(young.best().x[kYaw] - x[kYaw] - correction->error[2]), 0.0, 1e-9);
}

}  // namespace
}  // namespace perdure::semantic_filter
