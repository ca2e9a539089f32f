#include "services/semantic_filter/core/belief/detection_rate.h"

#include <gtest/gtest.h>

#include <cmath>

namespace perdure::semantic_filter {
namespace {

constexpr ViewScales kScales{0.15, 0.3, 1e9};
constexpr double kPrior = 3.0;

/// A viewpoint at `distance` metres and a bearing.
ViewRay from(double bearing, double distance) {
  const Eigen::Vector3d ray(std::cos(bearing), std::sin(bearing), 0.0);
  return {ray, Eigen::Vector3d::UnitZ(), std::log(distance)};
}

DetectionRate afterLooks(double bearing, double distance, int looks, int found) {
  DetectionRate rate;
  for (int i = 0; i < looks; ++i) rate.add(from(bearing, distance), 0.8, i < found, kScales);
  return rate;
}

TEST(DetectionRate, DetectionsOfAnEarlierVisitCountForSimilarViewpoints) {
  DetectionRate missed = afterLooks(0.3, 20.0, 10, 2), found = afterLooks(0.3, 20.0, 10, 10);
  missed.beginVisit(kScales);
  found.beginVisit(kScales);
  EXPECT_NEAR(missed.factor(from(0.3, 20.0), kPrior, kScales), (3.0 + 2.0) / (3.0 + 8.0), 1e-6);
  EXPECT_NEAR(found.factor(from(0.3, 20.0), kPrior, kScales), (3.0 + 10.0) / (3.0 + 8.0), 1e-6);
  const double near = missed.factor(from(0.36, 21.0), kPrior, kScales);
  EXPECT_GT(near, missed.factor(from(0.3, 20.0), kPrior, kScales));
  EXPECT_LT(near, 0.75);
  EXPECT_NEAR(missed.factor(from(-1.3, 20.0), kPrior, kScales), 1.0, 1e-3);
  EXPECT_NEAR(missed.factor(from(0.3, 150.0), kPrior, kScales), 1.0, 0.01);
}

TEST(DetectionRate, MissesOfOneVisitDoNotExcuseEachOther) {
  const DetectionRate rate = afterLooks(0.3, 20.0, 10, 0);
  EXPECT_EQ(rate.factor(from(0.3, 20.0), kPrior, kScales), 1.0);
  EXPECT_EQ(DetectionRate().factor(from(0.3, 20.0), kPrior, kScales), 1.0);
}

TEST(DetectionRate, TwoTracksOfOneObjectJoinTheirCounts) {
  DetectionRate a = afterLooks(0.3, 20.0, 5, 0), b = afterLooks(0.3, 20.0, 5, 0);
  a.beginVisit(kScales);
  b.beginVisit(kScales);
  a.join(b, kScales);
  EXPECT_NEAR(a.factor(from(0.3, 20.0), kPrior, kScales), 3.0 / (3.0 + 8.0), 1e-6);
}

TEST(DetectionRate, TheNumberOfViewpointsIsLimited) {
  DetectionRate rate;
  for (int lap = 0; lap < 50; ++lap) {
    for (int i = 0; i < 300; ++i) rate.add(from(0.02 * i, 10.0 + 0.3 * i), 0.8, true, kScales);
    rate.beginVisit(kScales);
  }
  EXPECT_LE(rate.views(), 2 * DetectionRate::kMostViews);
  EXPECT_GT(rate.factor(from(3.0, 55.0), kPrior, kScales), 1.15);
}

}  // namespace
}  // namespace perdure::semantic_filter
