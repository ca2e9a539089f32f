// Tests the decode rules of common network families on known values.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <random>

#include "common/base/errors.h"
#include "services/inference/core/decode/decode.h"
#include "services/inference/core/decode/weigh.h"
#include "services/inference/model_file.h"

namespace perdure::inference {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using Values = std::vector<float>;

/// Parses a model.json of 32×16 pixels and two classes; `rest` is appended after a comma.
ModelDescription parsed(const std::string& family, const std::string& rest,
                        const std::string& file = "m.json") {
  return parseModelDescription(
      R"({"input": {"width": 32, "height": 16, "fit": "resize", "colour": "rgb"},
          "classes": ["car", "person"], "family": ")" +
          family + "\", " + rest + "}",
      file);
}

std::string faultsOf(const std::string& family, const std::string& rest,
                     const std::string& file = "m.json") {
  try {
    parsed(family, rest, file);
  } catch (const StartupError& e) {
    return e.what();
  }
  return "it was taken";
}

std::vector<Candidate> decoded(const ModelDescription& model,
                               const std::vector<std::pair<std::vector<int>, Values>>& tensors,
                               double threshold = 0.001) {
  std::vector<Tensor> views;
  for (const auto& [shape, values] : tensors) views.push_back({shape, values});
  auto out = decode(model, {threshold, {0, 1}}, views);
  EXPECT_TRUE(out) << out.error().detail;
  return out ? *out : std::vector<Candidate>{};
}

Values randomValues(std::size_t count, unsigned seed, float spread = 2.0F) {
  std::mt19937 random(seed);
  std::normal_distribution<float> normal(0.0F, spread);
  Values values(count);
  for (float& v : values) v = normal(random);
  return values;
}

double logistic(double x) { return 1.0 / (1.0 + std::exp(-x)); }
double logOdds(double p) { return std::log(p / (1 - p)); }

void expectBox(const Box& box, double x1, double y1, double x2, double y2) {
  EXPECT_NEAR(box.x1, x1, 1e-4);
  EXPECT_NEAR(box.y1, y1, 1e-4);
  EXPECT_NEAR(box.x2, x2, 1e-4);
  EXPECT_NEAR(box.y2, y2, 1e-4);
}

const std::string kSigmoid = R"("activation": {"class": "sigmoid"}, )";
const std::string kApplied = R"("activation": {"class": "sigmoid", "applied": true}, )";

// 2×1 cells of 16 pixels, two anchors, rows of 5 + 2 values.
const std::string kAnchored =
    kSigmoid + R"("levels": [{"stride": 16, "tensor": "head", "anchors": [[10, 20], [30, 5]]}])";

TEST(DecodeYolov5, DoublesTheSigmoidsOfItsRawHeads) {
  const Values rows = randomValues(2 * 2 * 7, 3, 1.0F);  // dimensions: anchor, cell, value
  const auto out = decoded(parsed("yolov5", kAnchored), {{{1, 2, 1, 2, 7}, rows}});
  ASSERT_EQ(out.size(), 4u);
  for (std::size_t a = 0; a < 2; ++a) {
    for (std::size_t cell = 0; cell < 2; ++cell) {
      const float* t = rows.data() + (a * 2 + cell) * 7;
      const Candidate& c = out[a * 2 + cell];
      const double x = (2 * logistic(t[0]) - 0.5 + static_cast<double>(cell)) * 16;
      const double y = (2 * logistic(t[1]) - 0.5) * 16;
      const double w = std::pow(2 * logistic(t[2]), 2) * (a == 0 ? 10 : 30);
      const double h = std::pow(2 * logistic(t[3]), 2) * (a == 0 ? 20 : 5);
      expectBox(c.box, x - w / 2, y - h / 2, x + w / 2, y + h / 2);
      EXPECT_NEAR(c.activations[1], logOdds(logistic(t[4]) * logistic(t[5])), 1e-5);
      EXPECT_NEAR(c.activations[2], logOdds(logistic(t[4]) * logistic(t[6])), 1e-5);
    }
  }
}

TEST(DecodeYolov5, TakesTheConvolutionsOwnLayoutToo) {
  const Values rows = randomValues(2 * 2 * 7, 4);
  Values planes(rows.size());
  for (std::size_t a = 0; a < 2; ++a) {
    for (std::size_t cell = 0; cell < 2; ++cell) {
      for (std::size_t v = 0; v < 7; ++v) {
        planes[(a * 7 + v) * 2 + cell] = rows[(a * 2 + cell) * 7 + v];
      }
    }
  }
  const auto model = parsed("yolov7", kAnchored);
  const auto one = decoded(model, {{{1, 2, 1, 2, 7}, rows}});
  const auto other = decoded(model, {{{1, 14, 1, 2}, planes}});
  ASSERT_EQ(one.size(), other.size());
  ASSERT_FALSE(one.empty());
  for (std::size_t i = 0; i < one.size(); ++i) {
    EXPECT_EQ(one[i].activations, other[i].activations);
    EXPECT_EQ(one[i].box.x2, other[i].box.x2);
  }
}

TEST(DecodeYolov5, WhatIsExportedAsProbabilitiesComesBackAsTheirLogit) {
  const auto model = parsed("yolov5", kApplied + R"("outputs": {"predictions": "output0"})");
  const auto out =
      decoded(model, {{{1, 2, 7}, {10, 8, 6, 4, 0.5F, 0.75F, 0.1F, 0, 0, 1, 1, 0, 1, 1}}});
  ASSERT_EQ(out.size(), 1u) << "nothing has objectness 0";
  expectBox(out[0].box, 7, 6, 13, 10);
  EXPECT_NEAR(out[0].activations[1], logOdds(0.375), 1e-5);
  EXPECT_NEAR(out[0].activations[2], logOdds(0.05), 1e-5);
}

TEST(DecodeYolov5, AProbabilityOfOneIsNotCertainty) {
  const auto model = parsed("yolov5", kApplied + R"("outputs": {"predictions": "output0"})");
  const auto out = decoded(model, {{{1, 1, 7}, {10, 8, 6, 4, 1, 1, 0}}});
  ASSERT_EQ(out.size(), 1u);
  EXPECT_NEAR(out[0].activations[1], -std::log(2 * kLeastProbability), 1e-3);
  EXPECT_NEAR(out[0].activations[2], std::log(kLeastProbability), 1e-3);
}

/// Raw YOLOv8 heads of 2×1 cells with 4 bins; the expected sides are computed directly.
TEST(DecodeYolov8, SidesAreTheMeansOfTheirBins) {
  const auto split = parsed(
      "yolov8", kSigmoid + R"("bins": 4, "levels": [{"stride": 16, "box": "b", "classes": "c"}])");
  const Values sides = randomValues(16 * 2, 5), classes = {0.5F, -1.0F, 2.0F, -3.0F};
  const auto out = decoded(split, {{{1, 16, 1, 2}, sides}, {{1, 2, 1, 2}, classes}});
  ASSERT_EQ(out.size(), 2u);
  const auto distance = [&](std::size_t side, std::size_t cell) {
    double sum = 0, mean = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      const double e = std::exp(sides[(side * 4 + i) * 2 + cell]);
      sum += e, mean += e * static_cast<double>(i);
    }
    return 16 * mean / sum;
  };
  for (std::size_t cell = 0; cell < 2; ++cell) {
    const double x = 8 + 16.0 * static_cast<double>(cell), y = 8;
    expectBox(out[cell].box, x - distance(0, cell), y - distance(1, cell), x + distance(2, cell),
              y + distance(3, cell));
  }
  EXPECT_NEAR(out[1].activations[1], -1.0, 1e-5) << "without objectness the logit is the raw value";
  EXPECT_NEAR(out[1].activations[2], -3.0, 1e-5);

  const auto joined =
      parsed("yolov8", kSigmoid + R"("bins": 4, "levels": [{"stride": 16, "tensor": "t"}])");
  Values all = sides;
  all.insert(all.end(), classes.begin(), classes.end());
  const auto same = decoded(joined, {{{1, 18, 1, 2}, all}});
  ASSERT_EQ(same.size(), 2u);
  EXPECT_EQ(same[1].box.y2, out[1].box.y2);
  EXPECT_EQ(same[1].activations, out[1].activations);
}

TEST(DecodeYolov8, ReadsTheExportedPlanesAndTheTwoPartsBeforeTheSigmoid) {
  const auto exported = parsed("yolov8", kApplied + R"("outputs": {"predictions": "output0"})");
  // x, y, w, h, car, person of three boxes
  const Values planes = {10, 20, 5, 8, 8, 8, 6, 2, 2, 4, 4, 2, 0.9F, 0, 0.2F, 0.2F, 0, 0.6F};
  const auto out = decoded(exported, {{{1, 6, 3}, planes}});
  ASSERT_EQ(out.size(), 2u);
  expectBox(out[0].box, 7, 6, 13, 10);
  EXPECT_NEAR(out[0].activations[1], logOdds(0.9), 1e-5);
  EXPECT_NEAR(out[1].activations[2], logOdds(0.6), 1e-5);
  const auto raw = parsed("yolov8", kSigmoid + R"("outputs": {"boxes": "b", "scores": "s"})");
  const auto sure = decoded(raw, {{{1, 4, 1}, {10, 8, 6, 4}}, {{1, 2, 1}, {25, -25}}});
  ASSERT_EQ(sure.size(), 1u);
  EXPECT_NEAR(sure[0].activations[1], 25.0, 1e-4) << "not what a float's sigmoid can hold";
  EXPECT_NEAR(sure[0].activations[2], -25.0, 1e-4);
}

// Two cells with one bin: the values are the distances themselves (YOLO26, RTMDet).
TEST(DecodeYolov8, OfOneBinTheValueIsTheDistanceOrItsLogarithm) {
  const std::string level = R"("levels": [{"stride": 16, "box": "b", "classes": "c"}])";
  const Values sides = {0.5F, 1, 0.25F, -3, 0.75F, 1, 0.5F, 1}, classes = {1, 2, -1, 0};
  const auto linear = decoded(parsed("yolov8", kSigmoid + R"("bins": 1, )" + level),
                              {{{1, 4, 1, 2}, sides}, {{1, 2, 1, 2}, classes}});
  ASSERT_EQ(linear.size(), 1u) << "a box whose sides are beyond each other is none";
  expectBox(linear[0].box, 8 - 8, 8 - 4, 8 + 12, 8 + 8);
  const auto exponents = decoded(
      parsed("rtmdet", kSigmoid + R"("bins": 1, "cell_offset": 0, "distances": "exp", )" + level),
      {{{1, 4, 1, 2}, sides}, {{1, 2, 1, 2}, classes}});
  ASSERT_EQ(exponents.size(), 2u);
  const auto e = [](double x) { return 16 * std::exp(x); };
  expectBox(exponents[0].box, -e(0.5), -e(0.25), e(0.75), e(0.5));
  expectBox(exponents[1].box, 16 - e(1), -e(-3), 16 + e(1), e(1));
  EXPECT_THAT(faultsOf("yolov8", kSigmoid + R"("bins": 4, "distances": "exp", )" + level),
              HasSubstr("distances"));
}

TEST(DecodeYoloFastestV2, AnchorsOfACellShareItsClasses) {
  const auto model = parsed("yolo-fastestv2", R"("activation": {"class": "softmax"}, "levels": [
      {"stride": 16, "box": "b", "objectness": "o", "classes": "c", "anchors": [[10, 20], [30, 5]]}])");
  const Values box = randomValues(8 * 2, 21, 1.0F), objectness = {1, -0.5F, 0.25F, 2};
  const Values classes = {0.5F, 1, -0.5F, 3};
  const auto out =
      decoded(model, {{{1, 8, 1, 2}, box}, {{1, 2, 1, 2}, objectness}, {{1, 2, 1, 2}, classes}});
  ASSERT_EQ(out.size(), 4u);
  for (std::size_t a = 0; a < 2; ++a) {
    for (std::size_t cell = 0; cell < 2; ++cell) {
      const auto raw = [&](std::size_t v) { return logistic(box[(4 * a + v) * 2 + cell]); };
      const double x = (2 * raw(0) - 0.5 + static_cast<double>(cell)) * 16;
      const double y = (2 * raw(1) - 0.5) * 16;
      const double w = std::pow(2 * raw(2), 2) * (a == 0 ? 10 : 30);
      const double h = std::pow(2 * raw(3), 2) * (a == 0 ? 20 : 5);
      const Candidate& c = out[a * 2 + cell];
      expectBox(c.box, x - w / 2, y - h / 2, x + w / 2, y + h / 2);
      const double share = logistic(double{classes[cell]} - double{classes[2 + cell]});
      const double found = logistic(objectness[a * 2 + cell]);
      EXPECT_NEAR(c.activations[1], logOdds(found * share), 1e-4);
      EXPECT_NEAR(c.activations[2], logOdds(found * (1 - share)), 1e-4);
    }
  }
}

TEST(DecodeNanoDet, HasItsClassesFirstAndCellsBeyondTheBorder) {
  const auto whole =
      parsed("nanodet", kApplied + R"("bins": 2, "outputs": {"predictions": "output"},
                               "levels": [{"stride": 16}, {"stride": 64}])");
  // (2×1 + 1×1) cells of 2 classes and 4·2 bins. The last cell has probability 1 for distance 1.
  Values rows(3 * 10, 0.0F);
  rows[10] = 0.25F;
  rows[20 + 1] = 0.5F;
  for (const std::size_t side : {0u, 1u, 2u, 3u}) rows[20 + 2 + 2 * side + 1] = 80.0F;
  const auto out = decoded(whole, {{{1, 3, 10}, rows}});
  ASSERT_EQ(out.size(), 2u);
  expectBox(out[0].box, 16 - 8, -8, 16 + 8, 8);  // all distances are half a cell
  EXPECT_NEAR(out[0].activations[1], logOdds(0.25), 1e-5);
  expectBox(out[1].box, -64, -64, 64, 64);
  EXPECT_NEAR(out[1].activations[2], 0.0, 1e-5);

  const auto raw = parsed("nanodet", kSigmoid + R"("bins": 2, "cell_offset": 0.5,
                                                   "levels": [{"stride": 16, "tensor": "t"}])");
  Values planes(10 * 2, 0.0F);
  planes[1 * 2 + 1] = 1.5F;
  const auto cells = decoded(raw, {{{1, 10, 1, 2}, planes}});
  ASSERT_EQ(cells.size(), 2u);
  expectBox(cells[1].box, 16, 0, 32, 16);
  EXPECT_NEAR(cells[1].activations[2], 1.5, 1e-5);
}

TEST(DecodeSsd, TakesOffsetsFromItsPriorsAndTheBackgroundOutOfTheEvidence) {
  const fs::path folder = fs::path(::testing::TempDir()) / "perdure_priors";
  fs::create_directories(folder);
  std::ofstream(folder / "priors.txt") << "0.5 0.5 0.25 0.5\n0.1 0.2 0.3 0.4\n";
  const auto model = parsed("ssd", R"("activation": {"class": "softmax"},
      "outputs": {"boxes": "b", "scores": "s"},
      "boxes": {"form": "offsets", "priors_file": "priors.txt", "variances": [0.1, 0.2]})",
                            (folder / "m.json").string());
  fs::remove_all(folder);
  const auto out = decoded(
      model, {{{1, 2, 4}, {1, -2, 0.5F, -1, 0, 0, 0, 0}}, {{1, 2, 3}, {1, 2, -1, 40, 0, 0}}});
  ASSERT_EQ(out.size(), 1u) << "the second box is background";
  const double x = (0.5 + 0.1 * 0.25) * 32, y = (0.5 - 0.2 * 0.5) * 16;
  const double w = 0.25 * std::exp(0.1) * 32, h = 0.5 * std::exp(-0.2) * 16;
  expectBox(out[0].box, x - w / 2, y - h / 2, x + w / 2, y + h / 2);
  EXPECT_NEAR(out[0].activations[1], 2 - 1, 1e-5);
  EXPECT_NEAR(out[0].activations[2], -1 - 1, 1e-5);
  EXPECT_NEAR(out[0].score, std::exp(2) / (std::exp(1) + std::exp(2) + std::exp(-1)), 1e-6);
}

TEST(DecodeSsd, ReadsCornersWithYFirstAndProbabilities) {
  const auto model = parsed("ssd", R"("activation": {"class": "softmax", "applied": true},
      "outputs": {"boxes": "b", "scores": "s"}, "boxes": {"form": "corners", "y_first": true})");
  const auto out =
      decoded(model, {{{1, 1, 4}, {0.25F, 0.5F, 0.75F, 1}}, {{1, 1, 3}, {0.2F, 0.8F, 0}}});
  ASSERT_EQ(out.size(), 1u);
  expectBox(out[0].box, 16, 4, 32, 12);
  EXPECT_NEAR(out[0].activations[1], std::log(0.8 / 0.2), 1e-5);
  EXPECT_NEAR(out[0].activations[2], std::log(kLeastProbability / 0.2), 1e-5);
  const auto sigmoids = parsed("ssd", kSigmoid + R"("outputs": {"boxes": "b", "scores": "s"})");
  const auto alone = decoded(sigmoids, {{{1, 1, 4}, {0, 0, 1, 1}}, {{1, 1, 3}, {9, 1, -1}}});
  ASSERT_EQ(alone.size(), 1u);
  EXPECT_NEAR(alone[0].activations[1], 1.0, 1e-5) << "the background's sigmoid says nothing of it";
}

TEST(DecodeDetr, NoObjectIsTheLastColumnOrThereIsNone) {
  const std::string outputs = R"("outputs": {"boxes": "pred_boxes", "scores": "logits"})";
  const auto soft = parsed("detr", R"("activation": {"class": "softmax"}, )" + outputs);
  const auto out = decoded(soft, {{{1, 1, 4}, {0.5F, 0.5F, 0.25F, 0.5F}}, {{1, 1, 3}, {3, 0, 1}}});
  ASSERT_EQ(out.size(), 1u);
  expectBox(out[0].box, 12, 4, 20, 12);
  EXPECT_NEAR(out[0].activations[1], 2.0, 1e-5);
  EXPECT_NEAR(out[0].activations[2], -1.0, 1e-5);
  const auto alone =
      parsed("detr", kSigmoid + outputs + R"(, "boxes": {"form": "corners", "unit": "pixels"})");
  const auto plain = decoded(alone, {{{1, 1, 4}, {1, 2, 3, 4}}, {{1, 1, 2}, {1.5F, -2}}});
  ASSERT_EQ(plain.size(), 1u);
  expectBox(plain[0].box, 1, 2, 3, 4);
  EXPECT_NEAR(plain[0].activations[1], 1.5, 1e-5);
}

TEST(DecodeBoxes, RefusesWhatIsNotAsMany) {
  const auto model = parsed("detr", kSigmoid + R"("outputs": {"boxes": "b", "scores": "s"})");
  const Values boxes(12), scores(4);
  const auto out = decode(model, {0.05, {0, 1}}, {{{1, 3, 4}, boxes}, {{1, 2, 2}, scores}});
  ASSERT_FALSE(out);
  EXPECT_EQ(out.error().code, "model_output_shape");
  const auto wide = decode(model, {0.05, {0, 1}}, {{{1, 3, 4}, boxes}, {{1, 2, 3}, Values(6)}});
  ASSERT_FALSE(wide);
  EXPECT_THAT(wide.error().detail, HasSubstr("s is 1x2x3, not 1xNx2"));
}

/// A list with the name of a wrong, large file is rejected before it is read completely.
TEST(DescriptionOfFamilies, RefusesListsThatAreTooLarge) {
  const fs::path folder = fs::path(::testing::TempDir()) / "perdure_large_lists";
  fs::create_directories(folder);
  for (const char* name : {"priors.txt", "classes.txt"}) std::ofstream(folder / name) << "a\n";
  fs::resize_file(folder / "priors.txt", (16U << 20U) + 1);
  fs::resize_file(folder / "classes.txt", (1U << 20U) + 1);
  const std::string file = (folder / "m.json").string();
  EXPECT_THAT(faultsOf("ssd", R"("activation": {"class": "softmax"},
      "outputs": {"boxes": "b", "scores": "s"},
      "boxes": {"form": "offsets", "priors_file": "priors.txt", "variances": [0.1, 0.2]})",
                       file),
              HasSubstr("priors.txt is larger than 16 MiB; name a file with priors, one a line"));
  const auto classesOf = [&](const std::string& list) -> std::string {
    try {
      parseModelDescription(R"({"family": "yolox", "classes_file": ")" + list + "\"}", file);
    } catch (const StartupError& e) {
      return e.what();
    }
    return "it was taken";
  };
  EXPECT_THAT(classesOf("classes.txt"), HasSubstr("classes.txt is larger than 1 MiB"));
  EXPECT_THAT(classesOf("/dev/zero"), HasSubstr("/dev/zero is missing or holds no names"));
  fs::remove_all(folder);
}

TEST(DescriptionOfFamilies, TellsAllFaultsAtOnce) {
  const std::string ssd = faultsOf("ssd", R"("activation": {"class": "softmax",
      "background": "middle", "applied": 1, "class_exponent": 2}, "outputs": {"boxes": "b"},
      "boxes": {"form": "offsets", "priors_file": "none.txt", "variances": [0, 1]}, "levels": [])");
  for (const char* part :
       {"activation.background: \"middle\" is not one of first, last, none",
        "activation.applied: is not true or false", "activation.class_exponent: is not a known key",
        "outputs.scores: is missing", "none.txt is missing or holds no priors",
        "boxes.variances: is not a list of two numbers", "levels: is not a known key"}) {
    EXPECT_THAT(ssd, HasSubstr(part));
  }
  const std::string v8 = faultsOf("yolov8", kSigmoid + R"("bins": 0, "cell_offset": 2,
      "levels": [{"stride": 5, "box": "b"}])");
  for (const char* part : {"bins: is not an integer from 1 to 64", "cell_offset: is not a number",
                           "levels[0].stride: does not divide", "levels[0].classes: is missing"}) {
    EXPECT_THAT(v8, HasSubstr(part));
  }
  EXPECT_THAT(faultsOf("yolov5", kSigmoid + R"("outputs": {"predictions": 3})"),
              HasSubstr("outputs.predictions: is not a text"));
  EXPECT_THAT(faultsOf("detr", kSigmoid + R"("comment": "")"), HasSubstr("outputs: is missing"));
}

TEST(DescriptionOfFamilies, ScaleIsOneNumberOrThree) {
  const std::string rest = kSigmoid + R"("outputs": {"predictions": "o"})";
  const auto with = [&](const std::string& scale) {
    return parseModelDescription(R"({"family": "yolov5", "classes": ["a"], "input": {"width": 32,
        "height": 16, "fit": "resize", "colour": "rgb", "scale": )" +
                                     scale + "}, " + rest + "}",
                                 "m.json");
  };
  EXPECT_EQ(with("0.5").input.scale, (std::array<double, 3>{0.5, 0.5, 0.5}));
  EXPECT_EQ(with("[1, 2, 3]").input.scale, (std::array<double, 3>{1, 2, 3}));
  for (const char* wrong : {"[1, 2]", "0", "\"1\"", "[1, 2, -3]"}) {
    EXPECT_THROW(with(wrong), StartupError) << wrong;
  }
}

}  // namespace
}  // namespace perdure::inference
