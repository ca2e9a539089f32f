// The network in models/: that what is committed is what the service can use.
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

}  // namespace
}  // namespace perdure::inference
