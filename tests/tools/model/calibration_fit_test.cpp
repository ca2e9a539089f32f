// Fits a calibration to activations with known temperature.
#include "tools/model/calibration_fit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace perdure::tools {
namespace {

/// Boxes of a network with log-odds too large by the factor T and shifted by b. The labels are
/// drawn from softmax(0, odds / T + b).
std::vector<BoxOutcome> boxesOf(double temperature, double bias, std::size_t count) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal(-0.5, 2.0);
  std::uniform_real_distribution<double> uniform;
  std::vector<BoxOutcome> boxes;
  for (std::size_t i = 0; i < count; ++i) {
    BoxOutcome box;
    box.frame = i;
    double sum = 1.0;
    std::vector<double> weight = {1.0};
    for (int k = 0; k < 3; ++k) {
      const double z = normal(random) - (k > 0 ? 2.0 : 0.0);
      box.odds.push_back((z - bias) * temperature);
      weight.push_back(std::exp(z));
      sum += weight.back();
    }
    double draw = uniform(random) * sum;
    while (draw > weight[box.label] && box.label < 3) draw -= weight[box.label++];
    boxes.push_back(box);
  }
  return boxes;
}

TEST(CalibrationFit, RecoversAKnownTemperature) {
  for (const double temperature : {0.5, 1.0, 2.5}) {
    const Softening s = fitSoftening(boxesOf(temperature, 0.0, 8000));
    EXPECT_NEAR(s.temperature, temperature, 0.06 * temperature);
    EXPECT_EQ(s.bias, 0.0) << "a bias that is not there does not pay";
  }
}

TEST(CalibrationFit, RecoversAKnownBiasOfTheBackground) {
  const Softening s = fitSoftening(boxesOf(1.5, -1.2, 8000));
  EXPECT_NEAR(s.temperature, 1.5, 0.1);
  EXPECT_NEAR(s.bias, -1.2, 0.1);
}

TEST(CalibrationFit, HeldOutFramesAreCalibratedAfterItAndNotBefore) {
  const auto boxes = boxesOf(3.0, 0.0, 6000);
  const Reliability before = reliabilityOf(boxes, std::vector<Softening>(boxes.size()));
  const Reliability after = reliabilityOf(boxes, crossValidated(boxes, boxes.size()));
  EXPECT_GT(before.error, 0.08);
  EXPECT_LT(after.error, 0.03);
  EXPECT_LT(after.likelihood, before.likelihood);
  std::size_t in_bins = 0;
  for (const auto& bin : after.bins) in_bins += bin.count;
  EXPECT_EQ(in_bins, boxes.size());
}

TEST(CalibrationFit, BoxesOfOneKindChangeNothing) {
  std::vector<BoxOutcome> boxes(50, BoxOutcome{0, {1.0, 2.0}, 0});
  EXPECT_EQ(fitSoftening(boxes).temperature, 1.0);
  for (auto& box : boxes) box.label = 1;
  EXPECT_EQ(fitSoftening(boxes).temperature, 1.0);
  EXPECT_DOUBLE_EQ(clutterRateOf(boxes), 0.01);
}

/// Scores at expected places, with Gaussian distributions for present and absent objects, so that
/// the log ratio is linear.
std::vector<PrimedOutcome> placesOf(std::size_t there, std::size_t elsewhere) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  std::vector<PrimedOutcome> places;
  for (std::size_t i = 0; i < there + elsewhere; ++i) {
    PrimedOutcome place{i < there, {}};
    if (uniform(random) < (place.there ? 0.8 : 0.2))
      place.odds = normal(random) + (place.there ? -3.0 : -5.0);
    places.push_back(place);
  }
  return places;
}

TEST(CalibrationFit, EvidenceOfPrimedAnswersIsTheirLikelihoodRatioWhateverWasAskedMore) {
  // log N(s; -3, 1) / N(s; -5, 1) + log .8 / .2 = 2 s + 8 + log 4; without a score: log .2 / .8.
  for (const auto& [there, elsewhere] : {std::pair{3000U, 9000U}, {9000U, 3000U}}) {
    const auto fitted = fitPrimed(placesOf(there, elsewhere), 0.002);
    ASSERT_TRUE(fitted);
    EXPECT_NEAR(fitted->slope, 2.0, 0.15);
    EXPECT_NEAR(fitted->offset + fitted->slope * -4.0, std::log(4.0), 0.2);
    EXPECT_NEAR(fitted->nothing, -std::log(4.0), 0.1);
  }
}

TEST(CalibrationFit, WhereNothingIsPrimedAnswersSpeakAgainstOnAverage) {
  const auto places = placesOf(4000, 4000);
  const auto fitted = fitPrimed(places, 0.002);
  ASSERT_TRUE(fitted);
  double sum = 0.0;
  for (const auto& p : places) {
    if (!p.there) sum += p.odds ? fitted->offset + fitted->slope * *p.odds : fitted->nothing;
  }
  EXPECT_LT(sum / 4000.0, -0.5);
}

TEST(CalibrationFit, FewPlacesGiveNoPrimedEvidence) {
  EXPECT_FALSE(fitPrimed(placesOf(20, 500), 0.002));
  EXPECT_FALSE(fitPrimed(placesOf(500, 20), 0.002));
}

}  // namespace
}  // namespace perdure::tools
