// Tests the repair of operators that OpenCV 4.6 does not load or computes wrongly. Compares its
// answers with numpy's, operator by operator.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "services/inference/core/network/network.h"
#include "tests/tools/model/python.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;

std::string bytesOf(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

std::vector<float> floatsOf(const fs::path& file) {
  const std::string bytes = bytesOf(file);
  std::vector<float> values(bytes.size() / sizeof(float));
  std::copy(bytes.begin(), bytes.end(), reinterpret_cast<char*>(values.data()));
  return values;
}

TEST(Operators, AreComputedRightByOpenCvOnceRepaired) {
  if (!testing::pythonHasOnnx()) {
    GTEST_SKIP() << "python3-onnx is not installed (deploy/install --build)";
  }
  const fs::path folder = testing::generated("operator_cases.py");
  auto image = floatsOf(folder / "input.f32");
  const int sizes[] = {1, 3, 32, 32};
  const cv::Mat blob(4, sizes, CV_32F, image.data());
  std::size_t count = 0;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().extension() != ".onnx") continue;
    ++count;
    const std::string name = entry.path().stem().string();
    auto network = inference::loadWithOpenCv({bytesOf(entry.path()), ""}, {"out"});
    ASSERT_TRUE(network) << name << ": " << network.error().detail;
    const auto answer = (*network)->forward(blob);
    ASSERT_TRUE(answer) << name << ": " << answer.error().detail;
    const auto expected = floatsOf(fs::path(entry.path()).replace_extension(".f32"));
    const auto& values = answer->front().values;
    ASSERT_EQ(values.size(), expected.size()) << name;
    double worst = 0;
    for (std::size_t i = 0; i < expected.size(); ++i) {
      worst =
          std::max(worst, std::abs(double{values[i]} - expected[i]) / (1 + std::abs(expected[i])));
    }
    EXPECT_LT(worst, 1e-4) << name;
  }
  EXPECT_GT(count, 100u);
  fs::remove_all(folder);
}

}  // namespace
}  // namespace perdure::tools
