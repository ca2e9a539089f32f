#include "services/inference/core/decode/decode.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "services/inference/core/decode/evidence.h"

namespace perdure::inference {
namespace {

/// Raw tensors of one level without any detection, and their views.
struct Head {
  explicit Head(const ModelDescription& model) {
    for (const auto& shape : expectedShapes(model)) {
      std::size_t size = 1;
      for (const int n : shape) size *= static_cast<std::size_t>(n);
      values.emplace_back(size, -20.0F);
      shapes.push_back(shape);
    }
  }
  std::vector<Tensor> tensors() const {
    std::vector<Tensor> views;
    for (std::size_t i = 0; i < values.size(); ++i) views.push_back({shapes[i], values[i]});
    return views;
  }
  std::vector<std::vector<float>> values;
  std::vector<std::vector<int>> shapes;
};

ModelDescription model(Family family) {
  ModelDescription m;
  m.family = family;
  m.input.width = 64;
  m.input.height = 32;
  m.classes = {"car", "person", "chair"};
  Level level;
  level.stride = 16;
  level.box = "box", level.objectness = "objectness", level.classes = "classes";
  level.tensor = "tensor";
  level.anchors = {{10, 20}, {30, 5}};
  m.levels = {level};
  if (family == Family::kFastestDet) {
    m.class_softmax = true;
    m.objectness_exponent = 0.6;
    m.class_exponent = 0.4;
  }
  return m;
}

DecodeOptions all() { return {0.05, {0, 1, 2}}; }

double sigma(double x) { return 1.0 / (1.0 + std::exp(-x)); }

/// Sets box, objectness and class values of cell (column 3, row 1) of a 4×2 grid.
void putPlanes(Head& head, std::vector<float> box, float objectness, std::vector<float> classes) {
  const std::size_t cell = 7, cells = 8;
  for (std::size_t i = 0; i < 4; ++i) head.values[0][i * cells + cell] = box[i];
  head.values[1][cell] = objectness;
  for (std::size_t k = 0; k < classes.size(); ++k) head.values[2][k * cells + cell] = classes[k];
}

TEST(Decode, YoloxPutsTheBoxAtItsCellAndTheLogitOfTheScoreInTheActivations) {
  const auto m = model(Family::kYolox);
  Head head(m);
  putPlanes(head, {0.25F, -0.5F, 0.5F, -0.25F}, 1.5F, {2.0F, -1.0F, 0.5F});
  const auto out = decode(m, all(), head.tensors());
  ASSERT_TRUE(out);
  ASSERT_EQ(out->size(), 1u);
  const Box& b = out->front().box;
  EXPECT_NEAR((b.x1 + b.x2) / 2, 3.25 * 16, 1e-9);
  EXPECT_NEAR((b.y1 + b.y2) / 2, 0.5 * 16, 1e-9);
  EXPECT_NEAR(b.width(), std::exp(0.5) * 16, 1e-5);
  EXPECT_NEAR(b.height(), std::exp(-0.25) * 16, 1e-5);
  EXPECT_NEAR(out->front().score, sigma(1.5) * sigma(2.0), 1e-9);
  ASSERT_EQ(out->front().activations.size(), 4u);
  EXPECT_EQ(out->front().activations[0], 0.0F);
  const double logits[] = {2.0, -1.0, 0.5};
  for (std::size_t k = 0; k < 3; ++k) {
    const double p = sigma(1.5) * sigma(logits[k]);
    EXPECT_NEAR(out->front().activations[k + 1], std::log(p / (1 - p)), 1e-5);
  }
}

TEST(Decode, FastestDetWeighsObjectnessAndSoftMaxByTheirExponents) {
  const auto m = model(Family::kFastestDet);
  Head head(m);
  putPlanes(head, {0.3F, -0.2F, -1.0F, 0.4F}, 0.7F, {3.0F, 1.0F, 0.0F});
  const auto out = decode(m, all(), head.tensors());
  ASSERT_TRUE(out);
  ASSERT_EQ(out->size(), 1u);
  const Box& b = out->front().box;
  EXPECT_NEAR((b.x1 + b.x2) / 2, (3 + std::tanh(0.3)) * 16, 1e-5);
  EXPECT_NEAR((b.y1 + b.y2) / 2, (1 + std::tanh(-0.2)) * 16, 1e-5);
  EXPECT_NEAR(b.width(), sigma(-1.0) * 64, 1e-5);
  EXPECT_NEAR(b.height(), sigma(0.4) * 32, 1e-5);
  const double sum = std::exp(3.0) + std::exp(1.0) + 1.0;
  for (std::size_t k = 0; k < 3; ++k) {
    const double cls = std::exp(std::vector<double>{3, 1, 0}[k]) / sum;
    const double p = std::pow(sigma(0.7), 0.6) * std::pow(cls, 0.4);
    EXPECT_NEAR(out->front().activations[k + 1], std::log(p / (1 - p)), 1e-5);
  }
}

TEST(Decode, YoloFastestScalesTheAnchorOfItsRow) {
  const auto m = model(Family::kYoloFastest);
  Head head(m);
  // Row of the shape (1, 2, 4, 2·8): cell (2, 1), second anchor.
  const std::size_t at = ((1 * 4 + 2) * 2 + 1) * 8;
  const std::vector<float> row = {0.5F, -1.0F, 0.2F, -0.3F, 2.0F, -3.0F, 1.0F, 0.0F};
  std::copy(row.begin(), row.end(), head.values[0].begin() + static_cast<std::ptrdiff_t>(at));
  const auto out = decode(m, all(), head.tensors());
  ASSERT_TRUE(out);
  ASSERT_EQ(out->size(), 1u);
  const Box& b = out->front().box;
  EXPECT_NEAR((b.x1 + b.x2) / 2, (2 + sigma(0.5)) * 16, 1e-5);
  EXPECT_NEAR((b.y1 + b.y2) / 2, (1 + sigma(-1.0)) * 16, 1e-5);
  EXPECT_NEAR(b.width(), 30 * std::exp(0.2), 1e-5);
  EXPECT_NEAR(b.height(), 5 * std::exp(-0.3), 1e-5);
  EXPECT_NEAR(out->front().score, sigma(2.0) * sigma(1.0), 1e-9);
}

TEST(Decode, ReportsOnlyTheWantedClassesInTheirOrder) {
  const auto m = model(Family::kYolox);
  Head head(m);
  putPlanes(head, {0, 0, 0, 0}, 5.0F, {4.0F, -1.0F, 1.0F});
  const auto both = decode(m, {0.05, {2, 0}}, head.tensors());
  ASSERT_TRUE(both);
  ASSERT_EQ(both->at(0).activations.size(), 3u);
  EXPECT_LT(both->at(0).activations[1], both->at(0).activations[2]);
  const auto person = decode(m, {0.5, {1}}, head.tensors());
  ASSERT_TRUE(person);
  EXPECT_TRUE(person->empty()) << "the box is only strong for an unwanted class";
}

TEST(Decode, LeavesOutWhatScoresUnderTheThreshold) {
  const auto m = model(Family::kYolox);
  Head head(m);
  putPlanes(head, {0, 0, 0, 0}, 0.0F, {0.0F, -9.0F, -9.0F});  // score 0.25
  EXPECT_EQ(decode(m, {0.26, {0, 1, 2}}, head.tensors())->size(), 0u);
  EXPECT_EQ(decode(m, {0.24, {0, 1, 2}}, head.tensors())->size(), 1u);
}

TEST(Decode, RefusesTensorsOfAnotherShape) {
  const auto m = model(Family::kYolox);
  Head head(m);
  head.shapes[2][1] = 80;
  const auto out = decode(m, all(), head.tensors());
  ASSERT_FALSE(out);
  EXPECT_EQ(out.error().code, "model_output_shape");
  EXPECT_NE(out.error().detail.find("1x80x2x4"), std::string::npos) << out.error().detail;
  EXPECT_FALSE(decode(m, all(), {}));
}

TEST(Decode, RefusesNumbersThatAreNotFinite) {
  for (const Family family : {Family::kYolox, Family::kYoloFastest, Family::kFastestDet}) {
    const auto m = model(family);
    for (const float bad :
         {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
      Head head(m);
      head.values.back()[5] = bad;
      const auto out = decode(m, all(), head.tensors());
      ASSERT_FALSE(out);
      EXPECT_EQ(out.error().code, "model_output_not_finite");
    }
  }
}

TEST(Decode, RefusesABoxThatOverflows) {
  const auto m = model(Family::kYolox);
  Head head(m);
  putPlanes(head, {0, 0, 800.0F, 800.0F}, 5.0F, {4.0F, -1.0F, 1.0F});
  const auto out = decode(m, all(), head.tensors());
  ASSERT_FALSE(out);
  EXPECT_EQ(out.error().code, "model_output_not_finite");
}

TEST(Evidence, LogitFromLogIsExactAtBothEnds) {
  EXPECT_NEAR(logitFromLog(std::log(0.3)), std::log(0.3 / 0.7), 1e-12);
  EXPECT_NEAR(logitFromLog(-12.0), -12.0, 1e-5);
  EXPECT_NEAR(logitFromLog(std::log1p(-1e-9)), std::log(1e9), 1e-6);
  EXPECT_EQ(logitFromLog(0.0), kMaxLogit);
  EXPECT_EQ(logitFromLog(-1e5), -kMaxLogit);
}

TEST(Evidence, CalibrationDividesByTemperatureAndRemovesThePriorOddsOfClutter) {
  const double log_p = std::log(0.8);
  EXPECT_NEAR(activation({1.0, 0.5}, log_p), std::log(4.0), 1e-6);
  EXPECT_NEAR(activation({2.0, 0.5}, log_p), std::log(4.0) / 2, 1e-6);
  // If nine of ten boxes are clutter, p = 0.1 is no evidence.
  EXPECT_NEAR(activation({1.0, 0.9}, std::log(0.1)), 0.0, 1e-6);
}

}  // namespace
}  // namespace perdure::inference
