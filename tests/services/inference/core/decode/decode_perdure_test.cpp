#include "services/inference/core/decode/decode_families.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <numbers>

#include "common/base/errors.h"
#include "services/inference/node.h"
#include "tests/services/inference/tiny_onnx.h"

namespace perdure::inference {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
constexpr double kPi = std::numbers::pi;

ModelDescription tinyDescription() {
  return parseModelDescription(testing::TinyOnnx{}.json(), "tiny.json");
}

/// Returns the decoded candidates of heads with the same values in all four cells.
std::vector<Candidate> decodedHeads(const testing::TinyOnnx& tiny, const DecodeOptions& options,
                                    ModelDescription model = tinyDescription()) {
  std::vector<std::vector<float>> values;
  for (const auto* head : {&tiny.box, &tiny.logits, &tiny.azimuth}) {
    values.emplace_back();
    for (const float v : *head) values.back().insert(values.back().end(), 4, v);
  }
  std::vector<Tensor> tensors;
  const auto shapes = expectedShapes(model);
  for (std::size_t i = 0; i < shapes.size(); ++i) tensors.push_back({shapes[i], values[i]});
  auto result = decode(model, options, tensors);
  EXPECT_TRUE(result) << result.error().detail;
  return result ? *result : std::vector<Candidate>{};
}

double softPlus(double x) { return std::log1p(std::exp(x)); }

TEST(DecodePerdure, CellsReachBeyondABorderThatTheStrideDoesNotDivide) {
  const auto model = tinyDescription();
  EXPECT_EQ(cellsOf(model, model.levels[0]), (std::pair<int, int>{2, 2}));
  EXPECT_EQ(expectedShapes(model),
            (std::vector<std::vector<int>>{{1, 4, 2, 2}, {1, 3, 2, 2}, {1, 8, 2, 2}}));
}

TEST(DecodePerdure, SidesAreSoftPlusDistancesFromTheCentreOfTheCell) {
  const auto out = decodedHeads({}, {0.05, {0, 1}});
  ASSERT_EQ(out.size(), 4u);
  const Box& b = out[3].box;  // column 1, row 1: centre (48, 48)
  EXPECT_NEAR(b.x1, 48 - 32 * softPlus(0.5), 1e-5);
  EXPECT_NEAR(b.y1, 48 - 32 * softPlus(1.0), 1e-5);
  EXPECT_NEAR(b.x2, 48 + 32 * softPlus(-0.5), 1e-5);
  EXPECT_NEAR(b.y2, 48 + 32 * softPlus(2.0), 1e-5);
}

TEST(DecodePerdure, ACellMayLieOutsideTheObjectThatItFinds) {
  ModelDescription model = tinyDescription();
  model.reach = 0.5;
  testing::TinyOnnx tiny;
  tiny.box = {-5.0F, 1.0F, 2.0F, 2.0F};
  const Box b = decodedHeads(tiny, {0.05, {0, 1}}, model)[3].box;
  EXPECT_NEAR(b.x1, 48 - 32 * (softPlus(-5.0) - 0.5), 1e-5);
  EXPECT_GT(b.x1, 48) << "to the right of the cell's centre";
}

TEST(DecodePerdure, SpreadIsTheDeviationOfEachSide) {
  ModelDescription model = tinyDescription();
  model.spread_scale = 1.5;
  const testing::TinyOnnx tiny;
  const std::vector<float> spread{0.0F, 1.0F, -1.0F, 2.0F};
  std::vector<std::vector<float>> values;
  for (const auto* head : {&tiny.box, &tiny.logits, &tiny.azimuth, &spread}) {
    values.emplace_back();
    for (const float v : *head) values.back().insert(values.back().end(), 4, v);
  }
  std::vector<Tensor> tensors;
  const auto shapes = expectedShapes(model);
  ASSERT_EQ(shapes.size(), 4u);
  for (std::size_t i = 0; i < 4; ++i) tensors.push_back({shapes[i], values[i]});
  const auto out = decode(model, {0.05, {0, 1}}, tensors);
  ASSERT_TRUE(out);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_NEAR((*out)[0].side_sigma[i], 1.5 * 32 * softPlus(spread[i]), 1e-4);
  }
  EXPECT_EQ(decodedHeads(tiny, {0.05, {0, 1}})[0].side_sigma[0], 0.0) << "unknown without a spread";
}

TEST(DecodePerdure, ActivationsAreLogitsAgainstTheBackgroundsCalibrated) {
  const auto out = decodedHeads({}, {0.05, {0, 1}});
  const double sum = 1 + std::exp(1.0) + std::exp(-2.0);
  EXPECT_NEAR(out[0].score, std::exp(1.0) / sum, 1e-6);
  ASSERT_EQ(out[0].activations.size(), 3u);
  EXPECT_EQ(out[0].activations[0], 0.0F);
  EXPECT_NEAR(out[0].activations[1], 1.0 / 2 + std::log(3.0), 1e-5);  // T = 2, c = 3/4
  EXPECT_NEAR(out[0].activations[2], -2.0 / 2 + std::log(3.0), 1e-5);
}

TEST(DecodePerdure, ThresholdLooksAtTheSoftMaxOfTheWantedClasses) {
  const double p = std::exp(-2.0) / (1 + std::exp(1.0) + std::exp(-2.0));
  EXPECT_TRUE(decodedHeads({}, {p + 0.001, {1}}).empty());
  const auto out = decodedHeads({}, {p - 0.001, {1}});
  ASSERT_EQ(out.size(), 4u);
  EXPECT_EQ(out[0].activations.size(), 2u);
}

TEST(DecodePerdure, NoLookIsCertain) {
  testing::TinyOnnx sure;
  sure.logits = {-900.0F, 900.0F, 0.0F};
  const auto out = decodedHeads(sure, {0.05, {0, 1}});
  EXPECT_NEAR(out[0].activations[1], 15 + std::log(3.0), 1e-4);
}

TEST(DecodePerdure, AzimuthIsTheLikeliestBinAndItsResidual) {
  const auto out = decodedHeads({}, {0.05, {0, 1}});
  ASSERT_TRUE(out[0].azimuth);
  EXPECT_NEAR(*out[0].azimuth, kPi / 2 + 0.5 * kPi / 4, 1e-6);
  EXPECT_GT(out[0].azimuth_sigma, 0.2);
  testing::TinyOnnx other;
  other.azimuth = {0, 0, 0, 6, 0, 0, 0, 0};
  EXPECT_NEAR(*decodedHeads(other, {0.05, {0, 1}})[0].azimuth, -kPi / 2, 1e-6);
}

TEST(DecodePerdure, SigmaGrowsWithDoubtButNotByAMistakeOfFrontForBack) {
  testing::TinyOnnx sure, flipped, doubtful;
  sure.azimuth = {0, 40, 0, 0, 0, 0, 0, 0};
  flipped.azimuth = {0, 40, 0, 40, 0, 0, 0, 0};
  doubtful.azimuth = {40, 40, -40, -40, 0, 0, 0, 0};
  EXPECT_NEAR(decodedHeads(sure, {0.05, {0}})[0].azimuth_sigma, 0.2, 1e-6);
  EXPECT_NEAR(decodedHeads(flipped, {0.05, {0}})[0].azimuth_sigma, 0.2, 1e-6);
  EXPECT_GT(decodedHeads(doubtful, {0.05, {0}})[0].azimuth_sigma, kPi / 4);
}

TEST(DecodePerdure, OnlyClassesThatHaveAnAzimuthReportOne) {
  testing::TinyOnnx person;
  person.logits = {0.0F, 1.0F, 2.0F};
  EXPECT_FALSE(decodedHeads(person, {0.05, {0, 1}})[0].azimuth);
  EXPECT_TRUE(decodedHeads(person, {0.05, {0}})[0].azimuth) << "the best wanted class is the car";
}

TEST(DecodePerdure, AModelMayHaveNoAzimuthAtAll) {
  testing::TinyOnnx plain;
  plain.azimuth_json = "";
  std::string json = plain.json();
  json.replace(json.find(R"(, "azimuth": "azimuth32")"), 24, "");
  const auto model = parseModelDescription(json, "m.json");
  EXPECT_EQ(tensorNames(model), (std::vector<std::string>{"box32", "logits32"}));
  EXPECT_FALSE(decodedHeads(plain, {0.05, {0, 1}}, model)[0].azimuth);
}

TEST(DecodePerdure, RefusesADescriptionThatDoesNotFitItself) {
  testing::TinyOnnx wrong;
  wrong.azimuth_json =
      R"("azimuth": {"bins": 0, "sigma": -1, "classes": ["cat"], "parts": 3},
         "activation": {"class": "softmax"},)";
  std::string json = wrong.json();
  json.replace(json.find("logits32"), 8, "");
  try {
    parseModelDescription(json, "m.json");
    FAIL() << "it was taken";
  } catch (const StartupError& e) {
    for (const char* part : {"azimuth.bins", "azimuth.sigma", "\"cat\"", "azimuth.parts",
                             "activation: is not a known key", "levels[0].logits"}) {
      EXPECT_THAT(e.what(), HasSubstr(part));
    }
  }
}

TEST(DecodePerdure, WhatBoxesEncloseIsUnknownUnlessItIsSaid) {
  testing::TinyOnnx tiny;
  const std::string plain = tiny.azimuth_json;
  EXPECT_EQ(parseModelDescription(tiny.json(), "m.json").boxes, BoxExtent::kUnknown);
  tiny.azimuth_json = R"("box_extent": "outline",)" + plain;
  EXPECT_EQ(parseModelDescription(tiny.json(), "m.json").boxes, BoxExtent::kOutline);
  tiny.azimuth_json = R"("box_extent": "hull",)" + plain;
  try {
    parseModelDescription(tiny.json(), "m.json");
    FAIL() << "it was taken";
  } catch (const StartupError& e) {
    EXPECT_THAT(e.what(), HasSubstr("\"hull\" is not one of cuboid, outline"));
  }
}

TEST(DecodePerdure, InsetsAreFourOfEachOfTheModelsClasses) {
  testing::TinyOnnx tiny;
  const std::string plain = tiny.azimuth_json;
  tiny.azimuth_json = R"("side_insets": {"car": [0.04, 0.05, 0.03, -0.06]},)" + plain;
  const auto model = parseModelDescription(tiny.json(), "m.json");
  EXPECT_EQ(model.side_insets.at("car"), (std::array<double, 4>{0.04, 0.05, 0.03, -0.06}));
  tiny.azimuth_json =
      R"("side_insets": {"cat": [0, 0, 0, 0], "car": [0, 0, 0], "person": [0, 0, 0, 0.5]},)" +
      plain;
  try {
    parseModelDescription(tiny.json(), "m.json");
    FAIL() << "it was taken";
  } catch (const StartupError& e) {
    for (const char* part : {"\"cat\" is not one", "\"car\" has not four", "\"person\" has not"}) {
      EXPECT_THAT(e.what(), HasSubstr(part));
    }
  }
}

TEST(DecodePerdure, ANodeGivesTheKnownAnswerOfATinyOnnxFile) {
  const fs::path folder =
      fs::temp_directory_path() / ("perdure_tiny_onnx_" + std::to_string(getpid()));
  Config config;
  config.model.path = testing::TinyOnnx{}.write(folder);
  config.detection.merge_iou = 1.0;
  Node node(config, 5);
  Frame frame;
  frame.width = 128, frame.height = 96;
  frame.data = std::make_shared<const std::vector<std::uint8_t>>(128 * 96, std::uint8_t{9});
  const auto out = node.infer(frame);
  fs::remove_all(folder);
  ASSERT_TRUE(out) << out.error().detail;
  ASSERT_EQ(out->detections.size(), 4u);
  const Detection& d = out->detections[0];  // twice the size of the input
  EXPECT_NEAR(d.box.x1, 2 * (16 - 32 * softPlus(0.5)), 1e-3);
  EXPECT_NEAR(d.box.y2, 2 * (16 + 32 * softPlus(2.0)), 1e-3);
  EXPECT_NEAR(d.activations[1], 0.5 + std::log(3.0), 1e-4);
  ASSERT_TRUE(d.azimuth);
  EXPECT_NEAR(*d.azimuth, kPi / 2 + kPi / 8, 1e-5);
}

}  // namespace
}  // namespace perdure::inference
