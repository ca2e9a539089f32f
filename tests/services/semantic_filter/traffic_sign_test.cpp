// Traffic signs on posts, with the shipped priors: nothing but their images and sizes places them.
#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>

#include "common/math/chi2.h"
#include "services/semantic_filter/priors.h"
#include "tests/services/semantic_filter/scene.h"

namespace perdure::semantic_filter {
namespace {

using testing::makeState;
using testing::TrueObject;

/// The underside of signs above the ground, m (at least 2 m: VwV-StVO, sections 39 to 43 III).
constexpr double kUnderside = 2.0;

ClassPriors shippedPriors() {
  const char* source = std::getenv("PERDURE_SOURCE");
  return loadClassPriors(std::string(source ? source : ".") + "/config/class_priors.yaml");
}

ModelInfo carsAndSigns() {
  ModelInfo info = testing::makeModelInfo();
  info.classes = {"car", "traffic sign"};
  return info;
}

/// Parked cars show the ground at z = 0.
std::vector<TrueObject> streetWith(const TrueObject& sign) {
  std::vector<TrueObject> objects = {sign};
  for (int i = 0; i < 8; ++i) {
    const double y = i % 2 == 0 ? 5.5 : -5.5;
    objects.push_back({makeState(8.0 + 5.0 * i, y, 0.765, 0.0, 4.0, 1.67, 1.53), "car"});
  }
  return objects;
}

/// Drives 24 m along the street, until the sign is 6 m ahead. Returns the last message. The error
/// of the reported positions is a random walk of `walk` m/√m.
Objects driveTowards(const TrueObject& sign, const Config& config, double walk,
                     std::uint32_t seed) {
  constexpr double kStep = 0.5;  // m in a frame
  Objects last;
  Node node(config, shippedPriors(), 9, {[&](const Objects& m) { last = m; }, {}, {}});
  node.onCalibration(testing::calibrationOf(testing::makeCamera()));
  const ModelInfo info = carsAndSigns();
  node.onModel(info);
  const CameraModel camera{testing::makeCamera()};
  const auto objects = streetWith(sign);
  std::mt19937 random(seed);
  std::normal_distribution<double> step(0.0, walk * std::sqrt(kStep));
  RigidTransform reported(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.0, 0.0, 1.2));
  View view;
  view.camera = &camera;
  view.T_WB = reported;
  for (std::uint64_t k = 0; k < 48; ++k) {
    std::vector<Detection> list;
    for (const auto& o : objects) {
      auto d = testing::detect(o, view, BoxParameters{}, 0.5, 3.0, random);
      if (!d) continue;
      d->activations = {0.0F};
      for (const auto& name : info.classes) {
        d->activations.push_back(name == o.class_name ? 3.0F : -3.0F);
      }
      list.push_back(*d);
    }
    node.onOdometry(testing::odometryAt(k, reported));
    node.onDetections(testing::detectionsAt(k, list));
    view.T_WB.p.x() += kStep;
    reported.p += Eigen::Vector3d(kStep + step(random), step(random), step(random));
  }
  return last;
}

/// Returns the sign with the most detections.
const ObjectBelief* signIn(const Objects& objects) {
  const ObjectBelief* sign = nullptr;
  for (const auto& o : objects.objects) {
    if (o.best().name == "traffic sign" && (!sign || o.hits > sign->hits)) sign = &o;
  }
  return sign;
}

double squaredError(const ObjectBelief& belief, const TrueObject& sign) {
  const Eigen::Vector3d e = belief.best().mean.head<3>() - sign.x.head<3>();
  return e.dot(belief.best().covariance.topLeftCorner<3, 3>().ldlt().solve(e));
}

TrueObject signOf(double width, double height) {
  return {makeState(30, -3, kUnderside + 0.5 * height, M_PI, 0.08, width, height), "traffic sign"};
}

TEST(TrafficSign, IsPlacedWithoutGroundContactWhateverItsKind) {
  // Round or square of the middle size, a triangle, a plate, and the smallest round sign.
  const double kinds[][2] = {{0.60, 0.60}, {0.90, 0.78}, {0.60, 0.33}, {0.42, 0.42}};
  for (const auto& kind : kinds) {
    const TrueObject sign = signOf(kind[0], kind[1]);
    for (std::uint32_t seed = 1; seed <= 5; ++seed) {
      const Objects last = driveTowards(sign, Config{}, 0.0, seed);
      const ObjectBelief* found = signIn(last);
      ASSERT_TRUE(found) << kind[0] << " x " << kind[1] << ", seed " << seed;
      EXPECT_TRUE(found->confirmed);
      const Eigen::Vector3d error = found->best().mean.head<3>() - sign.x.head<3>();
      EXPECT_LT(error.norm(), 0.15) << kind[0] << " x " << kind[1] << ", seed " << seed;
      EXPECT_LT(squaredError(*found, sign), chi2Quantile(0.9997, 3));
    }
  }
}

/// Mean squared error per degree of freedom of signs that are observed from wandering poses.
double meanSquaredError(double assumed_walk) {
  constexpr double kWalk = 0.03;  // m/√m, that of KITTI's poses (tools/evaluate/README.md)
  constexpr std::uint32_t kRuns = 30;
  double sum = 0.0;
  for (std::uint32_t seed = 1; seed <= kRuns; ++seed) {
    const TrueObject sign = signOf(0.60, 0.60);
    Config config;
    config.filter.pose.walk_position = assumed_walk;
    const Objects last = driveTowards(sign, config, kWalk, seed);
    const ObjectBelief* found = signIn(last);
    if (!found) {
      ADD_FAILURE() << "no sign with seed " << seed;
      continue;
    }
    sum += squaredError(*found, sign) / 3.0;
  }
  return sum / kRuns;
}

TEST(TrafficSign, HasAConsistentCovarianceIfTheWalkOfThePosesIsDeclared) {
  const double undeclared = meanSquaredError(PoseParameters{}.walk_position);
  const double declared = meanSquaredError(0.03);
  std::printf("NEES of position per degree of freedom: %.2f, walk not declared: %.2f\n", declared,
              undeclared);
  EXPECT_GT(declared, 0.4);
  EXPECT_LT(declared, 1.6);
  EXPECT_GT(undeclared, 2.0 * declared);
}

}  // namespace
}  // namespace perdure::semantic_filter
