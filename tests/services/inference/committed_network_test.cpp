// Tests that the service can use the network committed in models/.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>

#include "services/inference/node.h"

namespace perdure::inference {
namespace {

namespace fs = std::filesystem;

fs::path models() {
  const char* folder = std::getenv("PERDURE_SOURCE");
  return fs::path(folder ? folder : ".") / "models";
}

Config committed() {
  Config config;
  config.model.path = (models() / "perdure_320x240.onnx").string();
  return config;
}

TEST(CommittedNetwork, IsAtMostTwoMegabytes) {
  EXPECT_LE(fs::file_size(models() / "perdure_320x240.onnx"), 2'000'000u);
}

TEST(CommittedNetwork, KnowsTheClassesOfTheSimulatorAndHowSharpItsBoxesAre) {
  const Node node(committed(), 1);
  EXPECT_EQ(node.model().classes,
            (std::vector<std::string>{"car", "van", "person", "bicycle", "chair", "dining table",
                                      "monitor", "couch"}));
  EXPECT_EQ(node.model().input_width, 320u);
  EXPECT_EQ(node.model().input_height, 240u);
  EXPECT_GT(node.model().box_sigma, 0.0);
  ASSERT_EQ(node.model().side_insets.size(), 4 * node.model().classes.size());
}

TEST(CommittedNetwork, OfTheDemoIsTheSameForLargerImages) {
  Config demo = committed();
  demo.model.path = (models() / "demo" / "perdure_480x360.onnx").string();
  const Node node(demo, 1), small(committed(), 2);
  EXPECT_EQ(node.model().input_width, 480u);
  EXPECT_EQ(node.model().input_height, 360u);
  EXPECT_EQ(node.model().classes, small.model().classes);
  EXPECT_EQ(node.model().box_sigma, small.model().box_sigma);
}

TEST(CommittedNetwork, IsSureOfNothingOnAFlatPictureOfAnySize) {
  Node node(committed(), 1);
  for (const auto& [width, height] : {std::pair{640u, 480u}, {320u, 240u}, {1242u, 375u}}) {
    Frame frame;
    frame.width = width, frame.height = height;
    frame.data = std::make_shared<const std::vector<std::uint8_t>>(std::size_t{width} * height,
                                                                   std::uint8_t{120});
    const auto out = node.infer(frame);
    ASSERT_TRUE(out) << out.error().detail;
    for (const Detection& d : out->detections) {
      EXPECT_LT(*std::max_element(d.activations.begin() + 1, d.activations.end()), 3.0F);
    }
  }
}

TEST(CommittedNetwork, TakesSmallerInputsWhereThereIsABudgetAndSaysWhich) {
  Config config = committed();
  config.model.budget_ms = 10.0;
  Node node(config, 1);
  const auto shares = node.sizeShares();
  ASSERT_GE(shares.size(), 3u);
  EXPECT_TRUE(std::is_sorted(shares.rbegin(), shares.rend()));
  EXPECT_LT(shares.back(), 0.4);
  Frame frame;
  frame.width = 640, frame.height = 480;
  frame.data = std::make_shared<const std::vector<std::uint8_t>>(640 * 480, std::uint8_t{120});
  for (std::size_t size = 0; size < shares.size(); ++size) {
    node.useSize(size);
    const auto out = node.infer(frame);
    ASSERT_TRUE(out) << out.error().detail;
    EXPECT_NEAR(out->input_scale * out->input_scale, shares[size], 0.12);
    EXPECT_EQ(out->model_hash, node.model().hash) << "the same model";
  }
}

Frame greyFrame() {
  Frame frame;
  frame.camera = "cam0";
  frame.width = 640, frame.height = 480;
  frame.data = std::make_shared<const std::vector<std::uint8_t>>(640 * 480, std::uint8_t{120});
  return frame;
}

TEST(CommittedNetwork, AnswersInPixelsOfTheImageBeforeItsTurn) {
  Config config = committed();
  config.detection.turn = "270";
  Node node(config, 1);
  const Frame frame = greyFrame();
  Predictions expected;
  expected.camera = "cam0";
  expected.predictions = {{7, "car", {600, 200, 630, 260}, 0.9, {}, {3, 3, 3, 3}}};
  const auto out = node.infer(frame, expected);
  ASSERT_TRUE(out) << out.error().detail;
  EXPECT_EQ(node.model().input_width, 240u) << "along the image's width, which became its height";
  EXPECT_EQ(node.model().input_height, 320u);
  const auto primed = std::find_if(out->detections.begin(), out->detections.end(),
                                   [](const Detection& d) { return d.primed_for == 7; });
  ASSERT_NE(primed, out->detections.end());
  EXPECT_GT(intersectionOverUnion(primed->box, expected.predictions[0].box), 0.3);
}

TEST(CommittedNetwork, AnswersWhatItIsAskedAboutAndOnlyThat) {
  Node node(committed(), 1);
  const Frame frame = greyFrame();
  Predictions expected;
  expected.camera = "cam0";
  expected.predictions = {{7, "car", {200, 200, 300, 260}, 0.9, {}, {3, 3, 3, 3}},
                          {8, "zeppelin", {200, 100, 300, 160}, 0.9, {}, {}},
                          {9, "car", {900, 100, 990, 160}, 0.9, {}, {}}};
  const auto out = node.infer(frame, expected);
  ASSERT_TRUE(out);
  std::vector<ObjectId> asked;
  for (const Detection& d : out->detections) {
    if (!d.primed) continue;
    asked.push_back(d.primed_for);
    EXPECT_LT(d.activations.at(1), 0.0F) << "there is nothing on a grey picture";
  }
  EXPECT_EQ(asked, std::vector<ObjectId>{7}) << "not of an unknown class, nor outside the picture";
  Config off = committed();
  off.detection.prime = false;
  Node deaf(off, 1);
  const auto unasked = deaf.infer(frame, expected);
  ASSERT_TRUE(unasked);
  for (const Detection& d : unasked->detections) EXPECT_FALSE(d.primed);
}

}  // namespace
}  // namespace perdure::inference
