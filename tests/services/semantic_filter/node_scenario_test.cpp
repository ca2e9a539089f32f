// Small scenes with exact truth: the cases that the filter must distinguish, and the consistency of
// its covariances.
#include <gtest/gtest.h>

#include "common/math/chi2.h"
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

/// Drives past the objects; every object is detected in every frame.
void run(Harness& h, const std::vector<TrueObject>& objects, std::uint64_t frames, double metres,
         double noise, std::uint32_t seed) {
  const CameraModel camera{testing::makeCamera()};
  std::mt19937 random(seed);
  for (std::uint64_t k = 0; k < frames; ++k) {
    View view;
    view.camera = &camera;
    view.T_WB = driveTo(k, metres);
    std::vector<Detection> list;
    for (const auto& o : objects) {
      if (auto d = detect(o, view, BoxParameters{}, noise, 3.0, random)) list.push_back(*d);
    }
    h.node.onOdometry(odometryAt(k, view.T_WB));
    h.node.onDetections(detectionsAt(k, list));
  }
}

double probabilityOfCar(const ObjectBelief& o) {
  for (const auto& c : o.classes) {
    if (c.name == "car") return o.existence * c.probability;
  }
  return 0.0;
}

TEST(NodeScenario, AToyThatResemblesACarIsDistinguishedByItsSize) {
  // The toy is a car of half a metre, 5 m ahead. Its image equals that of a car 42 m ahead.
  const TrueObject toy{makeState(5.3, 0.9, 0.75, 0.5, 0.5, 0.21, 0.18), "car"};
  const TrueObject car{makeState(16.0, -3.5, 0.75, 0.3, 4.2, 1.75, 1.5), "car"};
  Harness h;
  run(h, {toy, car}, 40, 0.08, 0.3, 5);
  double p_car = 0.0, p_toy = 0.0;
  for (const auto& o : h.objects.back().objects) {
    const Eigen::Vector3d p = o.best().mean.head<3>();
    const double bearing =
        std::atan2(p.y() - h.objects.back().T_WB.p.y(), p.x() - h.objects.back().T_WB.p.x());
    (bearing > 0.0 ? p_toy : p_car) = std::max(bearing > 0.0 ? p_toy : p_car, probabilityOfCar(o));
  }
  EXPECT_GE(p_car, 0.95);
  EXPECT_LE(p_toy, 0.05);
}

TEST(NodeScenario, WithoutParallaxNoClassIsRejectedAndTheCovarianceIsWide) {
  const TrueObject toy{makeState(5.3, 0.9, 0.75, 0.5, 0.5, 0.21, 0.18), "car"};
  Harness h;
  run(h, {toy}, 40, 0.0, 0.3, 5);
  ASSERT_EQ(h.objects.back().objects.size(), 1u);
  const auto& o = h.objects.back().objects.front();
  EXPECT_GT(probabilityOfCar(o), 0.5);
  const Eigen::Matrix3d P = o.best().covariance.topLeftCorner<3, 3>();
  EXPECT_GT(std::sqrt(P.trace()), 2.0);
}

TEST(NodeScenario, PositionErrorsMatchTheirCovariance) {
  // Sizes are drawn from the prior. Boxes are true projections plus the declared noise of the whole
  // car, and observations are independent. 19 of 20 squared normalised errors must lie below the 95
  // % quantile of χ², within the band of 600 draws. Their mean must not exceed the expected one.
  // The mean has no lower band: one car of 600 with a wrong state would compensate for the others.
  Config config;
  config.filter.tempering.correlation = 0.0;
  config.filter.box.bias_share = 0.0;
  config.filter.box.partial_view = 0.0;
  std::mt19937 random(21);
  std::normal_distribution<double> normal;
  constexpr int kRuns = 600;
  double sum = 0.0;
  int counted = 0, within = 0;
  for (int n = 0; n < kRuns; ++n) {
    TrueObject car{makeState(22 + 2 * normal(random), 4 + 0.5 * normal(random), 0.75,
                             0.3 * normal(random), 4.2, 1.75, 1.5),
                   "car"};
    for (int i = 4; i < 7; ++i) car.x[i] += 0.1 * normal(random);
    Harness h(config);
    run(h, {car}, 25, 0.5, 1.0, 100 + static_cast<std::uint32_t>(n));
    const ObjectBelief* best = nullptr;
    for (const auto& o : h.objects.back().objects) {
      if (!best || o.hits > best->hits) best = &o;
    }
    ASSERT_TRUE(best);
    const Eigen::Vector3d e = best->best().mean.head<3>() - car.x.head<3>();
    const Eigen::Matrix3d P = best->best().covariance.topLeftCorner<3, 3>();
    const double nees = e.dot(P.ldlt().solve(e));
    sum += nees;
    within += nees < chi2Quantile(0.95, 3);
    ++counted;
  }
  EXPECT_EQ(counted, kRuns);
  const double share = static_cast<double>(within) / kRuns;
  EXPECT_NEAR(share, 0.95, 2.5 * std::sqrt(0.95 * 0.05 / kRuns));
  EXPECT_LT(sum, chi2Quantile(0.975, 3 * kRuns));
  std::printf("mean NEES of position per degree of freedom: %.2f, within 95 %%: %.3f\n",
              sum / (3 * kRuns), share);
}

TEST(NodeScenario, AMovingCarIsReportedMovingAndLessCertainUnobservedAndAParkedOneIsNot) {
  const TrueObject parked{makeState(25, 4.5, 0.75, 0.0, 4.2, 1.75, 1.5), "car"};
  Config config;
  ClassPriors priors = testing::makePriors();
  priors.classes[0].moving = 0.2;
  priors.classes[0].speed_sigma = 8.0;
  Objects last;
  Node node(config, priors, 9, {[&](const Objects& m) { last = m; }, {}, {}});
  node.onCalibration(testing::calibrationOf(testing::makeCamera()));
  node.onModel(testing::makeModelInfo());
  const CameraModel camera{testing::makeCamera()};
  std::mt19937 random(8);
  State moving = makeState(15, -3.0, 0.75, 0.0, 4.2, 1.75, 1.5);
  for (std::uint64_t k = 0; k < 30; ++k) {
    View view;
    view.camera = &camera;
    view.T_WB = driveTo(k, 0.5);
    moving[0] += 0.9;
    std::vector<Detection> list;
    for (const auto& o : {parked, TrueObject{moving, "car"}}) {
      if (auto d = detect(o, view, BoxParameters{}, 0.5, 3.0, random)) list.push_back(*d);
    }
    node.onOdometry(odometryAt(k, view.T_WB));
    node.onDetections(detectionsAt(k, list));
  }
  const auto at = [&](bool right) {
    for (const auto& o : last.objects) {
      if (o.existence >= 0.5 && (o.best().mean[1] < 0) == right) return o;
    }
    ADD_FAILURE() << "one of the two is not believed";
    return last.objects.front();
  };
  const ObjectBelief driving = at(true), standing = at(false);
  EXPECT_GT(driving.moving, 0.9);
  EXPECT_LT(standing.moving, 0.1);
  // After two seconds without an observation it is published at its predicted position, with larger
  // variance.
  for (std::uint64_t k = 30; k < 50; ++k) node.onOdometry(odometryAt(k, driveTo(k, 0.5)));
  node.flush();
  const double seconds = 2.0, sigma_v = 0.3;
  EXPECT_NEAR(at(true).best().mean[0] - driving.best().mean[0], 9.0 * seconds, 4.0);
  EXPECT_GT(at(true).best().covariance(0, 0),
            driving.best().covariance(0, 0) + std::pow(sigma_v * seconds, 2));
  EXPECT_EQ(at(false).best().covariance, standing.best().covariance);
}

}  // namespace
}  // namespace perdure::semantic_filter
