// The noise scale of boxes and azimuths, learned while driving past parked cars.
#include <gtest/gtest.h>

#include "common/math/so3.h"
#include "services/semantic_filter/core/measurement/cuboid_projection.h"
#include "tests/services/semantic_filter/scene.h"

namespace perdure::semantic_filter {
namespace {

using testing::detect;
using testing::detectionsAt;
using testing::driveTo;
using testing::Harness;
using testing::makeState;
using testing::odometryAt;
using testing::TrueObject;

constexpr double kMetres = 0.4;
constexpr std::uint64_t kFrames = 200;

std::vector<TrueObject> parkedCars() {
  std::vector<TrueObject> cars;
  for (int i = 0; i < 16; ++i) {
    const double side = i % 2 == 0 ? 4.0 : -4.5;
    cars.push_back({makeState(14.0 + 6.0 * i, side, 0.75, 0.1 * (i % 3), 4.2, 1.75, 1.5), "car"});
  }
  return cars;
}

/// Boxes whose sides have `noise` times the assumed errors, with azimuths if `azimuth_sigma` is not
/// 0. `lasting`: share of the variance that the boxes of a car have in common while its distance
/// changes little.
Detections boxesAt(std::uint64_t k, double noise, double azimuth_sigma = 0.0,
                   double lasting = 0.0) {
  static const CameraModel camera{testing::makeCamera()};
  static const std::vector<TrueObject> cars = parkedCars();
  std::mt19937 random(static_cast<std::uint32_t>(k) + 77);
  const View view{&camera, driveTo(k, kMetres), Eigen::Vector3d::UnitZ()};
  std::vector<Detection> list;
  for (std::size_t i = 0; i < cars.size(); ++i) {
    const TrueObject& car = cars[i];
    if ((car.x.head<3>() - view.T_WB.p).norm() > 40.0) continue;
    auto d = detect(car, view, BoxParameters{}, noise * std::sqrt(1.0 - lasting), 3.0, random);
    const double near = std::log((car.x.head<3>() - view.T_WB.p).norm());
    std::mt19937 own(static_cast<std::uint32_t>(100.0 * i + std::floor(near / 0.3)));
    auto common = detect(car, view, BoxParameters{}, noise * std::sqrt(lasting), 3.0, own);
    const auto exact = detect(car, view, BoxParameters{}, 0.0, 3.0, own);
    if (!d || !common || !exact) continue;
    d->box.x1 += common->box.x1 - exact->box.x1;
    d->box.y1 += common->box.y1 - exact->box.y1;
    d->box.x2 += common->box.x2 - exact->box.x2;
    d->box.y2 += common->box.y2 - exact->box.y2;
    if (azimuth_sigma > 0.0) {
      std::normal_distribution<double> error(0.0, azimuth_sigma);
      const double straight = yawFromAzimuth(0.0, car.x.head<3>(), view);
      d->azimuth = wrapAngle(straight - car.x[kYaw] + error(random));
    }
    list.push_back(*d);
  }
  return detectionsAt(k, std::move(list));
}

void driveWithNoise(Harness& h, double noise, double azimuth_sigma = 0.0, double lasting = 0.0) {
  for (std::uint64_t k = 0; k < kFrames; ++k) {
    h.node.onOdometry(odometryAt(k, driveTo(k, kMetres)));
    h.node.onDetections(boxesAt(k, noise, azimuth_sigma, lasting));
  }
}

SideScales scalesOf(const Harness& h) {
  return h.node.belief().learned.sides.scales(testing::makeModelInfo().hash);
}

/// The whole variance over the assumed one.
double learned(const Harness& h) {
  const double share = Parameters{}.box.bias_share;
  return (1.0 - share) * scalesOf(h).noise + share * scalesOf(h).lasting;
}

double learnedFrom(double noise) {
  Harness h;
  driveWithNoise(h, noise);
  return learned(h);
}

TEST(NodeNoiseScale, LearnsTheNoiseScaleOfBoxes) {
  // The errors are drawn again for each observation, so none of them stays with the object,
  // although the model assumes that a part does.
  const double third = learnedFrom(0.35), once = learnedFrom(1.0), twice = learnedFrom(1.6);
  EXPECT_GT(third, 0.08);
  EXPECT_LT(third, 0.5);
  EXPECT_GT(once, 0.75);
  EXPECT_LT(once, 1.6);
  EXPECT_GT(twice, 1.6);
  EXPECT_LT(twice, 4.5);
}

TEST(NodeNoiseScale, LearnsTheShareThatLasts) {
  const auto shareLearned = [](double lasting) {
    Harness h;
    driveWithNoise(h, 1.0, 0.0, lasting);
    return Parameters{}.box.bias_share * scalesOf(h).lasting / learned(h);
  };
  const double none = shareLearned(0.0), third = shareLearned(0.3), most = shareLearned(0.8);
  EXPECT_LT(none, 0.2);
  EXPECT_GT(third, 0.12);
  EXPECT_LT(third, 0.45);
  EXPECT_GT(most, 0.5);
}

double azimuthsLearned(const Harness& h, double assumed = Parameters{}.box.prior_azimuths) {
  return h.node.belief().learned.azimuths.ratio(testing::makeModelInfo().hash, assumed);
}

double azimuthsLearnedFrom(double sigma, double assumed = Parameters{}.box.prior_azimuths) {
  Config config;
  config.filter.box.prior_azimuths = assumed;
  Harness h(config);
  driveWithNoise(h, 0.35, sigma);
  return azimuthsLearned(h, assumed);
}

TEST(NodeNoiseScale, LearnsTheNoiseScaleOfAzimuths) {
  const double assumed = 0.35;
  const double third = azimuthsLearnedFrom(assumed / 3.0), once = azimuthsLearnedFrom(assumed),
               twice = azimuthsLearnedFrom(1.8 * assumed);
  EXPECT_GT(third, 0.08);
  EXPECT_LT(third, 0.5);
  EXPECT_GT(once, 0.7);
  EXPECT_LT(once, 1.3);
  EXPECT_GT(twice, 1.4);
  EXPECT_LT(twice, 4.0);
  EXPECT_EQ(azimuthsLearnedFrom(assumed / 3.0, 0.0), 1.0);  // learning is off
}

TEST(NodeNoiseScale, LearnsTheSameFromLateBoxes) {
  Harness on_time, late;
  constexpr std::uint64_t kLate = 2;
  for (std::uint64_t k = 0; k < kFrames; ++k) {
    on_time.node.onOdometry(odometryAt(k, driveTo(k, kMetres)));
    on_time.node.onDetections(boxesAt(k, 0.35, 0.1));
    late.node.onOdometry(odometryAt(k, driveTo(k, kMetres)));
    if (k >= kLate) late.node.onDetections(boxesAt(k - kLate, 0.35, 0.1));
  }
  for (std::uint64_t k = kFrames - kLate; k < kFrames; ++k)
    late.node.onDetections(boxesAt(k, 0.35, 0.1));
  EXPECT_LT(learned(on_time), 0.9);
  EXPECT_NEAR(learned(late), learned(on_time), 1e-9);
  EXPECT_LT(azimuthsLearned(on_time), 0.9);
  EXPECT_NEAR(azimuthsLearned(late), azimuthsLearned(on_time), 1e-9);
}

TEST(NodeNoiseScale, ReportsTheNoiseScaleOfTheBoxes) {
  Harness h;
  EXPECT_EQ(h.node.note(), "");
  driveWithNoise(h, 0.35);
  EXPECT_NE(h.node.note().find("boxes err 0."), std::string::npos) << h.node.note();
  EXPECT_EQ(h.node.note().find("azimuths"), std::string::npos) << h.node.note();
}

TEST(NodeNoiseScale, KeepsTheNoiseScaleWhenOdometryRestarts) {
  Harness h;
  driveWithNoise(h, 0.35, 0.1);
  EXPECT_NE(h.node.note().find("azimuths err 0."), std::string::npos) << h.node.note();
  const double before = learned(h);
  const std::string note = h.node.note();
  Odometry anew = odometryAt(kFrames, driveTo(0, kMetres));
  anew.world = {6, 1};
  h.node.onOdometry(anew);
  EXPECT_EQ(learned(h), before);
  EXPECT_NE(h.node.note().find(note), std::string::npos) << h.node.note();
}

}  // namespace
}  // namespace perdure::semantic_filter
