// Tests real networks, if they are present. The imported descriptions must match the hand-written
// ones in config/models for the same files.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "common/base/subprocess.h"
#include "services/inference/node.h"
#include "tests/tools/model/python.h"
#include "tools/model/check.h"
#include "tools/model/importer.h"
#include "tools/model/look.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;

fs::path source() {
  const char* folder = std::getenv("PERDURE_SOURCE");
  return folder != nullptr ? folder : ".";
}

fs::path data() { return source() / "../shared/data"; }

std::vector<Detection> answerOf(const fs::path& network, const fs::path& description,
                                const Frame& frame) {
  inference::Config config;
  config.model.path = network.string();
  config.model.description = description.string();
  inference::Node node(config, 1);
  const auto out = node.infer(frame);
  EXPECT_TRUE(out) << out.error().detail;
  return out ? out->detections : std::vector<Detection>{};
}

std::string cocoNames() { return (source() / "config/models/coco.names").string(); }

fs::path streetPicture() {
  return data() / "kitti_raw/2011_09_26/2011_09_26_drive_0005_sync/image_02/data/0000000000.jpg";
}

/// Imports a network of ../shared/data, or a file derived from one, and returns its detections.
std::vector<Sight> seenBy(const fs::path& network, const std::vector<std::string>& more = {}) {
  const fs::path folder = fs::temp_directory_path() / ("perdure_seen_" + std::to_string(getpid()));
  const fs::path out = importedPath(network, folder);
  std::vector<std::string> arguments = {"--classes=" + cocoNames()};
  arguments.insert(arguments.end(), more.begin(), more.end());
  EXPECT_EQ(importNetwork({network, out, "", folder / "reference", arguments}), 0);
  EXPECT_LT(checkAnswers(out, folder / "reference").difference, kMostDifference);
  const Frame frame = readPicture(streetPicture());
  const Look look = lookAt(out, &frame, 0.3);
  fs::remove_all(folder);
  return look.sights;
}

void expectSame(const std::vector<Sight>& a, const std::vector<Sight>& b, double px, double score) {
  ASSERT_EQ(a.size(), b.size());
  EXPECT_GT(a.size(), 4u);
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].name, b[i].name);
    EXPECT_NEAR(a[i].score, b[i].score, score);
    EXPECT_NEAR(a[i].box.x1, b[i].box.x1, px);
    EXPECT_NEAR(a[i].box.y2, b[i].box.y2, px);
  }
}

class RealWeights : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!fs::exists(data() / "weights")) GTEST_SKIP() << "../shared/data is absent: no network";
    if (!testing::pythonHasOnnx()) GTEST_SKIP() << "python3-onnx is not installed";
  }
  static fs::path weights(const std::string& name) { return data() / "weights" / name; }
};

// Two files with the same weights, exported at two sizes: each one, reshaped, must equal the other.
TEST_F(RealWeights, ReshapedToASizeAnswerAsTheFileOfThatSize) {
  const fs::path wide = weights("nanodet-plus-m_768x256.onnx");
  const fs::path small = weights("nanodet-plus-m_640x192.onnx");
  expectSame(seenBy(wide, {"--input=640x192"}), seenBy(small), 1e-2, 1e-4);
  expectSame(seenBy(small, {"--input=768x256"}), seenBy(wide), 1e-2, 1e-4);
}

TEST_F(RealWeights, PicoDetSeesTheStreetThoughItsConstantsStandAmongItsInputs) {
  const auto sights = seenBy(weights("picodet_s_768x256.onnx"));
  const auto has = [&](const std::string& name, double x1, double y1, double x2, double y2) {
    return std::any_of(sights.begin(), sights.end(), [&](const Sight& s) {
      return s.name == name && std::abs(s.box.x1 - x1) < 10 && std::abs(s.box.y1 - y1) < 10 &&
             std::abs(s.box.x2 - x2) < 10 && std::abs(s.box.y2 - y2) < 10;
    });
  };
  // The boxes of YOLOX-nano, which has another decode rule.
  EXPECT_TRUE(has("person", 772, 168, 882, 368));
  EXPECT_TRUE(has("car", 295, 170, 453, 287));
}

fs::path quantised(const fs::path& network, const fs::path& folder, const std::string& way) {
  const fs::path out = folder / (network.stem().string() + "_" + way + ".onnx");
  const auto made = runProgram(
      {.command = {"/usr/bin/python3", (source() / "tests/tools/model/quantise.py").string(),
                   network.string(), out.string(), way}});
  EXPECT_EQ(made.status, 0) << made.output;
  return out;
}

// The error of the rounding to eight bits (.03 in a score here) must not count as an error of the
// import.
TEST_F(RealWeights, OfEightBitsAnswerAsTheFloatsThatTheBitsStandFor) {
  const fs::path folder = fs::temp_directory_path() / ("perdure_bits_" + std::to_string(getpid()));
  fs::create_directories(folder);
  for (const char* name : {"nanodet-plus-m_640x192.onnx", "yolox_nano_416.onnx"}) {
    const auto floats = seenBy(quantised(weights(name), folder, "rounded"));
    for (const char* way : {"qdq", "dynamic"}) {
      SCOPED_TRACE(std::string(name) + " " + way);
      expectSame(seenBy(quantised(weights(name), folder, way)), floats, 0.5, 1e-3);
    }
  }
  fs::remove_all(folder);
}

class RealFiles : public ::testing::TestWithParam<const char*> {};

TEST_P(RealFiles, SayWhatTheirDescriptionsInConfigSay) {
  const fs::path network = data() / "weights" / (std::string(GetParam()) + ".onnx");
  if (!fs::exists(network)) GTEST_SKIP() << "../shared/data is absent: no network to try";
  if (!testing::pythonHasOnnx()) GTEST_SKIP() << "python3-onnx is not installed";
  const fs::path folder = fs::temp_directory_path() / ("perdure_real_" + std::to_string(getpid()));
  const fs::path out = importedPath(network, folder);
  const std::string names = (source() / "config/models/coco.names").string();
  ASSERT_EQ(importNetwork({network, out, "", folder / "reference", {"--classes=" + names}}), 0);
  EXPECT_LT(checkAnswers(out, folder / "reference").difference, kMostDifference);
  const Frame frame = readPicture(
      data() / "kitti_raw/2011_09_26/2011_09_26_drive_0005_sync/image_02/data/0000000000.jpg");
  const fs::path written = out.string() + ".model.json";
  const fs::path shipped = source() / "config/models" / (std::string(GetParam()) + ".json");
  // The merging of boxes depends on the calibration, which the import does not know.
  auto json = nlohmann::json::parse(std::ifstream(written));
  json["calibration"] = nlohmann::json::parse(std::ifstream(shipped))["calibration"];
  std::ofstream(written) << json;
  const auto imported = answerOf(out, written, frame),
             described = answerOf(network, shipped, frame);
  fs::remove_all(folder);
  ASSERT_EQ(imported.size(), described.size());
  EXPECT_GT(described.size(), 5u);
  for (std::size_t i = 0; i < described.size(); ++i) {
    const Detection &a = imported[i], &b = described[i];
    EXPECT_NEAR(a.box.x1, b.box.x1, 1e-3);
    EXPECT_NEAR(a.box.y2, b.box.y2, 1e-3);
    for (std::size_t k = 1; k < b.activations.size(); ++k) {
      EXPECT_NEAR(a.activations[k], b.activations[k], 1e-3);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(All, RealFiles, ::testing::Values("yolox_nano_416", "FastestDet_352_coco"),
                         [](const auto& one) { return std::string(one.param); });

}  // namespace
}  // namespace perdure::tools
