#include <gtest/gtest.h>

#include <random>

#include "services/semantic_filter/core/belief/learned.h"
#include "services/semantic_filter/core/visibility/detectability.h"
#include "tests/services/semantic_filter/scene.h"

namespace perdure::semantic_filter {
namespace {

constexpr std::uint64_t kDetector = 5;

/// Learns from `count` observations of a detector that finds half of the objects of `half_px`.
double learned(double half_px, int count) {
  const CameraModel camera{testing::makeCamera()};
  const ClassPriors priors = testing::makePriors();
  const ClassPrior& car = priors.of("car");
  Parameters parameters;
  FrameContext frame;
  frame.view.camera = &camera;
  frame.parameters = &parameters;
  std::mt19937 random(3);
  std::uniform_real_distribution<double> size_px(8.0, 90.0), dice(0.0, 1.0);
  DetectionSizes sizes;
  for (int i = 0; i < count; ++i) {
    const double size = size_px(random);
    frame.size_scale = half_px / parameters.box.min_size_px;
    const bool detected = dice(random) < detectionProbability(car, size, frame);
    frame.size_scale = sizes.scale(kDetector);
    sizes.learn(kDetector, sizeEvidence(car, size, detected, frame));
  }
  return sizes.scale(kDetector) * parameters.box.min_size_px;
}

TEST(DetectionSizes, AreThoseOfTheDetector) {
  EXPECT_NEAR(learned(30.0, 1000), 30.0, 3.0);
  EXPECT_NEAR(learned(14.0, 1000), 14.0, 2.0);
  EXPECT_NEAR(learned(10.0, 1000), 10.0, 2.0);
}

TEST(DetectionSizes, BeginWithTheAssumption) {
  EXPECT_EQ(learned(30.0, 0), Parameters().box.min_size_px);
  EXPECT_LT(learned(30.0, 3), 25.0) << "three observations say little";
}

TEST(DetectionSizes, BelongToANetwork) {
  DetectionSizes sizes;
  sizes.learn(kDetector, {5.0, 10.0});
  EXPECT_GT(sizes.scale(kDetector), 1.2);
  EXPECT_EQ(sizes.scale(kDetector + 1), 1.0);
  const double before = sizes.scale(kDetector);
  sizes.learn(kDetector, {std::nan(""), 1.0});
  EXPECT_EQ(sizes.scale(kDetector), before);
}

}  // namespace
}  // namespace perdure::semantic_filter
