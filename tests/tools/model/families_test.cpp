// Tests each family from the exported file to boxes with evidence. The file is imported, repaired,
// loaded by OpenCV (or by ONNX Runtime if only that has the operators), and decoded as in the
// service. The results are compared with values that the generator computed from the published
// rules.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>

#include "services/inference/core/decode/decode.h"
#include "services/inference/core/network/image_fit.h"
#include "services/inference/core/network/network.h"
#include "services/inference/model_file.h"
#include "tests/tools/model/python.h"
#include "tools/model/check.h"
#include "tools/model/importer.h"
#include "tools/model/look.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;

constexpr double kThreshold = 0.02;

struct Expected {
  Box box;
  std::vector<double> log_odds;
  /// Log-odds of the best class, to which the threshold applies if there is no background class.
  double best() const { return *std::max_element(log_odds.begin(), log_odds.end()); }
};

std::vector<Expected> expectedIn(const fs::path& file) {
  std::ifstream in(file);
  std::vector<Expected> rows;
  for (std::string line; std::getline(in, line);) {
    std::istringstream words(line);
    Expected row;
    words >> row.box.x1 >> row.box.y1 >> row.box.x2 >> row.box.y2;
    for (double value = 0; words >> value;) row.log_odds.push_back(value);
    rows.push_back(row);
  }
  return rows;
}

std::vector<std::string> linesOf(const fs::path& file) {
  std::ifstream in(file);
  std::vector<std::string> lines;
  for (std::string line; std::getline(in, line);) {
    if (!line.empty()) lines.push_back(line);
  }
  return lines;
}

/// Returns all candidates of the image before overlaps are merged, without calibration.
std::vector<inference::Candidate> candidatesOf(const fs::path& network, const fs::path& picture) {
  auto file = inference::readModelFile(network.string(), "", {});
  file.description.calibration = {1.0, 0.5};
  const auto names = inference::tensorNames(file.description);
  auto loaded = file.description.for_onnx_runtime
                    ? inference::loadWithOnnxRuntime({file.network, ""}, names, 1)
                    : inference::loadWithOpenCv({file.network, ""}, names);
  EXPECT_TRUE(loaded) << loaded.error().detail;
  const auto blob = inference::makeBlob(file.description.input, readPicture(picture));
  const auto tensors = (*loaded)->forward(*blob);
  EXPECT_TRUE(tensors) << tensors.error().detail;
  std::vector<std::size_t> wanted(file.description.classes.size());
  for (std::size_t i = 0; i < wanted.size(); ++i) wanted[i] = i;
  auto found = inference::decode(file.description, {kThreshold, wanted}, *tensors);
  EXPECT_TRUE(found) << found.error().detail;
  return found ? *found : std::vector<inference::Candidate>{};
}

double differenceOf(const Expected& expected, const inference::Candidate& found) {
  const Box &a = expected.box, &b = found.box;
  double largest = std::max(
      {std::abs(a.x1 - b.x1), std::abs(a.y1 - b.y1), std::abs(a.x2 - b.x2), std::abs(a.y2 - b.y2)});
  for (std::size_t k = 0; k < expected.log_odds.size(); ++k) {
    largest = std::max(largest, std::abs(expected.log_odds[k] - found.activations.at(k + 1)));
  }
  return largest;
}

double sigmoid(double x) { return 1 / (1 + std::exp(-x)); }

class Families : public ::testing::TestWithParam<const char*> {
 protected:
  static void SetUpTestSuite() {
    if (testing::pythonHasOnnx()) folder_ = testing::generated("tiny_networks.py");
  }
  static void TearDownTestSuite() {
    if (!folder_.empty()) fs::remove_all(folder_);
  }
  void SetUp() override {
    if (folder_.empty()) GTEST_SKIP() << "python3-onnx is not installed (deploy/install --build)";
    const bool queries = std::string(GetParam()).starts_with("rtdetr");
    if (queries && !inference::hasOnnxRuntime()) {
      GTEST_SKIP() << "skipped: built where ONNX Runtime is not (Debian 12 has none)";
    }
    here_ = folder_ / GetParam();
    out_ = importedPath(here_ / "net.onnx", "");
  }
  static fs::path folder_;
  fs::path here_, out_;
};
fs::path Families::folder_;

TEST_P(Families, AnswerAsTheirPublishedRulesSay) {
  ASSERT_EQ(importNetwork(
                {here_ / "net.onnx", out_, "", here_ / "reference", linesOf(here_ / "arguments")}),
            0);
  EXPECT_LT(checkAnswers(out_, here_ / "reference").difference, 1e-4);
  const auto found = candidatesOf(out_, here_ / "picture.ppm");
  const auto expected = expectedIn(here_ / "expected.csv");
  std::size_t sure = 0;
  for (const Expected& row : expected) {
    double least = INFINITY;
    for (const auto& candidate : found) least = std::min(least, differenceOf(row, candidate));
    // Near the threshold a box may be accepted or rejected. With a background class, the soft-max
    // score is lower than the odds against the background alone suggest.
    if (sigmoid(row.best()) < 3 * kThreshold) continue;
    ++sure;
    EXPECT_LT(least, 2e-3) << "box " << row.box.x1 << " " << row.box.y1 << " " << row.box.x2;
  }
  EXPECT_GT(sure, expected.size() / 10) << "the network says next to nothing";
  EXPECT_LE(found.size(), expected.size());
  for (const auto& candidate : found) {  // all other candidates must match as well
    double least = INFINITY;
    for (const Expected& row : expected) least = std::min(least, differenceOf(row, candidate));
    EXPECT_LT(least, 2e-3);
  }
}

TEST_P(Families, DrawWhatTheySee) {
  if (!fs::exists(out_)) GTEST_SKIP() << "the import failed";
  const Frame picture = readPicture(here_ / "picture.ppm");
  const Look look = lookAt(out_, &picture, 0.1);
  EXPECT_EQ(look.input_width, 64);
  EXPECT_FALSE(look.sights.empty());
  drawSights(picture, look.sights, here_ / "seen.png");
  EXPECT_EQ(readPicture(here_ / "seen.png").width, 64u);
}

INSTANTIATE_TEST_SUITE_P(All, Families,
                         ::testing::Values("yolov5", "yolov5_heads", "yolov5_suppressed", "yolov7",
                                           "yolov8", "yolov8_masks", "yolov8_open_size",
                                           "yolov8_whole", "yolox", "yolox_decoded", "nanodet",
                                           "ssd", "ssd_offsets", "detr", "detr_sigmoids", "yolov10",
                                           "yolov10_both", "yolo26", "rtmdet", "rtmdet_suppressed",
                                           "picodet", "picodet_leftovers", "yolo_fastestv2",
                                           "rtdetr", "rtdetr_chosen", "yolov8_qdq",
                                           "yolov8_dynamic", "yolov8_qlinear"),
                         [](const auto& one) { return std::string(one.param); });

}  // namespace
}  // namespace perdure::tools
