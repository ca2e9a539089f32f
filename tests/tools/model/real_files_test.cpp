// Real networks, where they are at hand: imported, they say what their hand-written descriptions
// in config/models make of the same files.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>

#include "services/inference/core/decode/evidence.h"
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

struct Answer {
  std::vector<Detection> detections;
  double clutter;  ///< what calibration has added to each activation
};

Answer answerOf(const fs::path& network, const fs::path& description, const Frame& frame) {
  inference::Config config;
  config.model.path = network.string();
  config.model.description = description.string();
  inference::Node node(config, 1);
  const auto file = inference::readModelFile(config.model.path, config.model.description, {});
  const auto out = node.infer(frame);
  EXPECT_TRUE(out) << out.error().detail;
  return {out ? out->detections : std::vector<Detection>{},
          inference::logit(file.description.calibration.clutter_rate)};
}

class RealFiles : public ::testing::TestWithParam<const char*> {};

TEST_P(RealFiles, SayWhatTheirDescriptionsInConfigSay) {
  const fs::path network = data() / "weights" / (std::string(GetParam()) + ".onnx");
  if (!fs::exists(network)) GTEST_SKIP() << "../shared/data is absent: no network to try";
  if (!testing::pythonHasOnnx()) GTEST_SKIP() << "python3-onnx is not installed";
  const fs::path folder = fs::temp_directory_path() / ("perdure_real_" + std::to_string(getpid()));
  const fs::path out = importedPath(network, folder);
  const std::string names = (source() / "config/models/coco.names").string();
  ASSERT_EQ(importNetwork({network, out, folder / "reference", {"--classes=" + names}}), 0);
  EXPECT_LT(checkAnswers(out, folder / "reference").difference, kMostDifference);
  const Frame frame = readPicture(
      data() / "kitti_raw/2011_09_26/2011_09_26_drive_0005_sync/image_02/data/0000000000.jpg");
  const Answer imported = answerOf(out, out.string() + ".model.json", frame);
  const Answer described =
      answerOf(network, source() / "config/models" / (std::string(GetParam()) + ".json"), frame);
  fs::remove_all(folder);
  ASSERT_EQ(imported.detections.size(), described.detections.size());
  EXPECT_GT(described.detections.size(), 5u);
  for (std::size_t i = 0; i < described.detections.size(); ++i) {
    const Detection &a = imported.detections[i], &b = described.detections[i];
    EXPECT_NEAR(a.box.x1, b.box.x1, 1e-3);
    EXPECT_NEAR(a.box.y2, b.box.y2, 1e-3);
    for (std::size_t k = 1; k < b.activations.size(); ++k) {
      EXPECT_NEAR(a.activations[k] - imported.clutter, b.activations[k] - described.clutter, 1e-4);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(All, RealFiles, ::testing::Values("yolox_nano_416", "FastestDet_352_coco"),
                         [](const auto& one) { return std::string(one.param); });

}  // namespace
}  // namespace perdure::tools
