#include "services/semantic_filter/core/measurement/box_likelihood.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace perdure::semantic_filter {
namespace {

constexpr double kWidth = 1242, kHeight = 375;

BoxParameters gatedAt(double gate, double tail = 5.0) {
  BoxParameters parameters;
  parameters.gate = gate;
  parameters.tail = tail;
  parameters.partial_view = 0.0;
  return parameters;
}

ProjectedBox predictedBox(double x1, double y1, double x2, double y2) {
  ProjectedBox p;
  p.sides << x1, y1, x2, y2;
  return p;
}

TEST(BoxLikelihood, ASideAtTheImageBorderIsCensored) {
  const auto z = measure({0.0, 100, 200, 200}, kWidth, kHeight, {});
  EXPECT_FALSE(z.measured[0]);
  EXPECT_TRUE(z.measured[1] && z.measured[2] && z.measured[3]);
}

TEST(BoxLikelihood, ABoxThatLeavesTheImageIsCutThere) {
  const auto z = measure({-40, 100, 200, 420}, kWidth, kHeight, {});
  EXPECT_EQ(z.sides[0], 0.0);
  EXPECT_EQ(z.sides[3], kHeight);
  EXPECT_EQ(z.count(), 2);
}

TEST(BoxLikelihood, WithAThinTailTheDensityOfAllSidesIsTheGaussian) {
  const auto z = measure({100, 100, 200, 180}, kWidth, kHeight, {});
  const auto score = scoreBox(z, predictedBox(102, 100, 200, 180), Eigen::Matrix4d::Zero(), {},
                              gatedAt(0.9999, 1e6));
  ASSERT_TRUE(score);
  double expected = 0.0;
  for (int i = 0; i < 4; ++i) expected -= 0.5 * std::log(2.0 * M_PI * z.variance[i]);
  expected -= 0.5 * 4.0 / z.variance[0];
  EXPECT_NEAR(score->log_density, expected, 1e-4);
  EXPECT_NEAR(score->nis, 4.0 / z.variance[0], 1e-9);
}

TEST(BoxLikelihood, AnOutlierCostsLessThanAGaussianWouldTake) {
  const auto z = measure({100, 100, 200, 180}, kWidth, kHeight, {});
  const double sigma = std::sqrt(z.variance[0]);
  const auto at = [&](double deviations, double tail) {
    return scoreBox(z, predictedBox(100 + deviations * sigma, 100, 200, 180),
                    Eigen::Matrix4d::Zero(), {}, gatedAt(0.999999, tail))
        ->log_density;
  };
  EXPECT_NEAR(at(4, 1e6) - at(0, 1e6), -8.0, 1e-3);
  EXPECT_GT(at(4, 5.0) - at(0, 5.0), -7.0);
  EXPECT_LT(at(4, 5.0), at(2, 5.0));
}

TEST(BoxLikelihood, NoiseGrowsWithThePixelsOfTheNetworksInput) {
  BoxParameters parameters;
  parameters.sigma_px = 0.5;
  parameters.sigma_network_px = 1.0;
  const auto fine = measure({100, 100, 120, 120}, kWidth, kHeight, parameters, {0.05, 0.0});
  const auto coarse = measure({100, 100, 120, 120}, kWidth, kHeight, parameters, {0.05, 3.0});
  const double noise = std::sqrt(1.0 - parameters.bias_share);
  EXPECT_NEAR(std::sqrt(coarse.variance[0]) - std::sqrt(fine.variance[0]), 2.5 * noise, 1e-9);
}

TEST(BoxLikelihood, NoiseAndBiasAddUpToTheWholeError) {
  BoxParameters parameters;
  parameters.sigma_px = 2.0;
  const BoxNoise noise{.relative = 0.1};
  const auto z = measure({100, 100, 200, 180}, kWidth, kHeight, parameters, noise);
  const Eigen::Vector4d stays = biasSigma(lastingError(parameters, noise), 100.0, 80.0);
  EXPECT_NEAR(std::hypot(std::sqrt(z.variance[0]), stays[0] * 100.0), 12.0, 1e-6);
  EXPECT_NEAR(std::hypot(std::sqrt(z.variance[3]), stays[3] * 80.0), 10.0, 1e-6);
  EXPECT_NEAR(std::pow(stays[0] * 100.0, 2), 144.0 * parameters.bias_share, 1e-6);
}

TEST(BoxLikelihood, ABoxThatMayBeClutterHasMoreNoise) {
  BoxParameters parameters;
  parameters.sigma_weak = 0.2;
  const auto at = [&](double clutter) {
    return measure({100, 100, 200, 180}, kWidth, kHeight, parameters,
                   {.clutter_probability = clutter})
        .variance[0];
  };
  EXPECT_GT(at(0.5), at(0.0));
  EXPECT_GT(at(1.0), 1.5 * at(0.5));
}

TEST(BoxLikelihood, ADeviationThatTheNetworkGivesReplacesTheAssumedOne) {
  const BoxParameters parameters;
  BoxNoise noise{.relative = 0.05};
  noise.sides = {40.0, 0.0, 2.0, 0.0};
  const auto z = measure({100, 100, 200, 180}, kWidth, kHeight, parameters, noise);
  const double stays =
      100.0 * biasSigma(lastingError(parameters, {.relative = 0.05}), 100.0, 80.0)[0];
  EXPECT_NEAR(z.variance[0], 1600.0 - stays * stays, 1e-6);
  EXPECT_NEAR(z.variance[2], 4.0 * (1.0 - parameters.bias_share), 1e-6)
      << "it may be surer than boxes are on the whole, but noise is left";
  EXPECT_GT(z.variance[1], 0.0);
}

TEST(BoxLikelihood, ACensoredSideCountsAsTheProbabilityThatItLiesBeyond) {
  const auto z = measure({0.0, 100, 200, 180}, kWidth, kHeight, {});
  const auto far =
      scoreBox(z, predictedBox(-300, 100, 200, 180), Eigen::Matrix4d::Zero(), {}, gatedAt(0.9999));
  const auto edge =
      scoreBox(z, predictedBox(0, 100, 200, 180), Eigen::Matrix4d::Zero(), {}, gatedAt(0.9999));
  ASSERT_TRUE(far && edge);
  EXPECT_EQ(far->dof, 3);
  EXPECT_NEAR(far->log_density - edge->log_density, std::log(2.0), 1e-9);
}

TEST(BoxLikelihood, AHiddenSideMayLieBeyondTheOccluder) {
  const auto z = measure({300, 100, 400, 180}, kWidth, kHeight, {});
  const std::array<bool, 4> left_hidden{true, false, false, false};
  const auto p = predictedBox(250, 100, 400, 180);
  EXPECT_FALSE(scoreBox(z, p, Eigen::Matrix4d::Zero(), {}, gatedAt(0.9999)));
  EXPECT_TRUE(scoreBox(z, p, Eigen::Matrix4d::Zero(), left_hidden, gatedAt(0.9999)));
}

TEST(BoxLikelihood, ABoxOfTheWholeObjectIsLikelierThanOneThatEndsAnywhere) {
  const std::array<bool, 4> hidden{false, false, true, true};
  const auto p = predictedBox(250, 100, 400, 180);
  const auto at = [&](double x2, double y2) {
    const auto z = measure({250, 100, x2, y2}, kWidth, kHeight, {});
    return scoreBox(z, p, Eigen::Matrix4d::Zero(), hidden, gatedAt(0.9999))->log_density;
  };
  EXPECT_GT(at(400, 180), at(340, 150) + 3.0);
  EXPECT_NEAR(at(340, 150), at(320, 140), 1.0) << "an end within is as likely as another";
  const auto z = measure({250, 100, 460, 180}, kWidth, kHeight, {});
  const auto beyond = scoreBox(z, p, Eigen::Matrix4d::Zero(), hidden, gatedAt(0.9999));
  EXPECT_TRUE(!beyond || beyond->log_density < at(340, 150) - 8.0) << "no end lies outside";
}

// A track that was occluded by a van has a wide prediction, half of which is behind the van. Boxes
// of parked cars that appear beside the van must not be assigned to it.
TEST(BoxLikelihood, ANarrowPredictionBeatsAWideOne) {
  const auto z = measure({899, 187, 1012, 245}, kWidth, kHeight, {});
  const auto likelihood = [&](const ProjectedBox& p, double sigma,
                              const std::array<bool, 4>& hidden) {
    const Eigen::Matrix4d covariance = sigma * sigma * Eigen::Matrix4d::Identity();
    const auto score = scoreBox(z, p, covariance, hidden, gatedAt(0.9999));
    return score ? std::exp(score->log_density) : 0.0;
  };
  const double parked =
      likelihood(predictedBox(899, 187, 1005, 241), 6.0, {false, true, true, true});
  const double lost =
      likelihood(predictedBox(899, 183, 1131, 268), 40.0, {false, false, true, true});
  EXPECT_GT(parked, 100.0 * lost);
}

TEST(BoxLikelihood, ABoxMayEndWhereAnUnmappedOccluderHidesTheRest) {
  auto parameters = gatedAt(0.9999);
  const auto z = measure({250, 100, 330, 180}, kWidth, kHeight, {});
  const auto p = predictedBox(250, 100, 400, 180);
  EXPECT_FALSE(scoreBox(z, p, Eigen::Matrix4d::Zero(), {}, parameters));
  parameters.partial_view = 0.1;
  const auto part = scoreBox(z, p, Eigen::Matrix4d::Zero(), {}, parameters);
  ASSERT_TRUE(part);
  EXPECT_EQ(part->part, 2) << "the right side";
  const auto whole = scoreBox(measure({250, 100, 400, 180}, kWidth, kHeight, {}), p,
                              Eigen::Matrix4d::Zero(), {}, parameters);
  ASSERT_TRUE(whole);
  EXPECT_EQ(whole->part, -1);
  EXPECT_GT(whole->log_density, part->log_density + 4.0);
  const auto longer = measure({250, 100, 500, 180}, kWidth, kHeight, {});
  EXPECT_FALSE(scoreBox(longer, p, Eigen::Matrix4d::Zero(), {}, parameters)) << "it is no part";
}

TEST(BoxLikelihood, OutsideTheGateThereIsNoScore) {
  const auto z = measure({100, 100, 200, 180}, kWidth, kHeight, {});
  EXPECT_FALSE(
      scoreBox(z, predictedBox(200, 100, 300, 180), Eigen::Matrix4d::Zero(), {}, gatedAt(0.999)));
}

TEST(BoxLikelihood, ClutterOfMeasuredSidesIntegratesToItsExpectedNumber) {
  ClutterParameters clutter;
  clutter.per_frame = 3.0;
  // Boxes are uniform in centre and log-uniform in size. The sum runs over a grid of sizes, with
  // any centre.
  double total = 0.0;
  constexpr int kSteps = 400;
  const double lw = std::log(kWidth / clutter.min_size_px) / kSteps;
  const double lh = std::log(kHeight / clutter.min_size_px) / kSteps;
  for (int i = 0; i < kSteps; ++i) {
    for (int j = 0; j < kSteps; ++j) {
      const double w = clutter.min_size_px * std::exp((i + 0.5) * lw);
      const double h = clutter.min_size_px * std::exp((j + 0.5) * lh);
      BoxMeasurement z;
      z.sides << 0, 0, w, h;
      total += std::exp(logClutter(z, kWidth, kHeight, clutter)) * w * lw * h * lh;
    }
  }
  EXPECT_NEAR(total * kWidth * kHeight, clutter.per_frame, 1e-3 * clutter.per_frame);
}

/// Mean ratio, over the false boxes of an image, of the likelihoods that a box is of this object or
/// clutter.
double ratioOfChanceBoxes(const ProjectedBox& predicted, double sigma,
                          const std::array<bool, 4>& hidden) {
  const Eigen::Matrix4d covariance = sigma * sigma * Eigen::Matrix4d::Identity();
  const ClutterParameters clutter;
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit;
  constexpr int kBoxes = 400000;
  double sum = 0.0;
  for (int n = 0; n < kBoxes; ++n) {
    Box box;
    for (int axis = 0; axis < 2; ++axis) {
      const double extent = axis == 0 ? kWidth : kHeight;
      const double size =
          clutter.min_size_px * std::pow(extent / clutter.min_size_px, unit(random));
      const double centre = extent * unit(random);
      (axis == 0 ? box.x1 : box.y1) = centre - 0.5 * size;
      (axis == 0 ? box.x2 : box.y2) = centre + 0.5 * size;
    }
    if (box.x1 < 10 || box.y1 < 10 || box.x2 > kWidth - 10 || box.y2 > kHeight - 10) continue;
    const auto z = measure(box, kWidth, kHeight, {});
    auto parameters = gatedAt(0.9999);
    parameters.partial_view = 0.1;
    const auto score = scoreBox(z, predicted, covariance, hidden, parameters);
    if (!score) continue;
    sum += std::exp(score->log_density - logClutter(z, kWidth, kHeight, clutter, score->ignored));
  }
  return clutter.per_frame * sum / kBoxes;
}

// If the mean ratio exceeded one, false boxes would make non-existing objects certain.
TEST(BoxLikelihood, OverAllChanceBoxesTheRatioAveragesToOneAtMost) {
  EXPECT_NEAR(ratioOfChanceBoxes(predictedBox(500, 100, 800, 260), 25.0, {}), 1.0, 0.2);
  EXPECT_LT(ratioOfChanceBoxes(predictedBox(500, 100, 800, 260), 25.0, {false, false, true, false}),
            1.2);
  EXPECT_LT(ratioOfChanceBoxes(predictedBox(500, 100, 800, 260), 25.0, {true, false, true, true}),
            1.2);
  ProjectedBox near = predictedBox(-1280, -700, 60, 290);  // the object passes behind the camera
  near.exact = {false, false, true, true};
  EXPECT_LT(ratioOfChanceBoxes(near, 25.0, {}), 0.05) << "its left side must be out of the picture";
  near = predictedBox(600, 100, 2600, 290);
  near.exact = {true, true, false, true};
  EXPECT_LT(ratioOfChanceBoxes(near, 25.0, {}), 1.2);
}

}  // namespace
}  // namespace perdure::semantic_filter
