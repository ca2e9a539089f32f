// Computes one network with each backend of this build.
#include <gmock/gmock.h>
#include <unistd.h>

#include <cstdlib>

#include "common/base/errors.h"
#include "services/inference/node.h"
#include "tests/services/inference/tiny_onnx.h"

namespace perdure::inference {
namespace {

using ::testing::HasSubstr;

class Backends : public ::testing::Test {
 protected:
  Config config(const testing::TinyOnnx& net, const std::string& backend) {
    Config config;
    config.model.path = net.write(folder_ / net.name);
    config.model.backend = backend;
    return config;
  }
  std::string error(const Config& config) {
    try {
      Node(config, 1);
    } catch (const StartupError& e) {
      return e.what();
    }
    return "";
  }
  static Frame frame() {
    Frame frame;
    frame.width = 64;
    frame.height = 48;
    frame.data = std::make_shared<const std::vector<std::uint8_t>>(64 * 48, std::uint8_t{90});
    return frame;
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  const std::filesystem::path folder_ =
      std::filesystem::temp_directory_path() / ("perdure_backends_" + std::to_string(getpid()));
};

TEST_F(Backends, OfAutoIsOpenCvWhereItTakesTheFile) {
  EXPECT_THAT(Node(config({}, "auto"), 1).backend(), HasSubstr("OpenCV"));
  EXPECT_THAT(Node(config({}, "opencv"), 1).backend(), HasSubstr("OpenCV"));
}

TEST_F(Backends, SayWhichOperatorOpenCvDoesNotTake) {
  testing::TinyOnnx other;
  other.for_other_runtimes = true;
  EXPECT_THAT(error(config(other, "opencv")), HasSubstr("ReverseSequence"));
}

TEST_F(Backends, SayThatTheBuildHasNoOnnxRuntime) {
  if (hasOnnxRuntime()) GTEST_SKIP() << "skipped: this build has it";
  EXPECT_THAT(error(config({}, "onnxruntime")), HasSubstr("build again where libonnxruntime-dev"));
}

TEST_F(Backends, OfAutoIsTheOneThatTheDescriptionNames) {
  const Config c = config({}, "auto");
  std::string description = testing::TinyOnnx().json();
  description.insert(1, R"("backend": "onnxruntime", )");
  std::ofstream(c.model.path + ".model.json") << description;
  if (hasOnnxRuntime()) {
    EXPECT_THAT(Node(c, 1).backend(), HasSubstr("ONNX Runtime"));
  } else {
    EXPECT_THAT(error(c), HasSubstr("has operators that OpenCV does not have"));
    EXPECT_THAT(error(c), HasSubstr("build again where libonnxruntime-dev is (Debian 13)"));
  }
  description.replace(description.find("onnxruntime"), 11, "tensorflow!");
  std::ofstream(c.model.path + ".model.json") << description;
  EXPECT_THAT(error(c), HasSubstr("backend: \"tensorflow!\" is not one of auto, onnxruntime"));
}

class OnnxRuntime : public Backends {
 protected:
  void SetUp() override {
    if (!hasOnnxRuntime()) {
      GTEST_SKIP() << "skipped: built where ONNX Runtime is not (Debian 12 has none)";
    }
  }
};

TEST_F(OnnxRuntime, AnswersAsOpenCvDoes) {
  testing::TinyOnnx net;
  net.logits_by_light = {0.0F, 0.02F, 0.01F};
  net.box_by_light = {0.01F, 0.0F, -0.01F, 0.02F};
  Node by_opencv(config(net, "opencv"), 1), by_runtime(config(net, "onnxruntime"), 1);
  EXPECT_THAT(by_runtime.backend(), HasSubstr("ONNX Runtime"));
  EXPECT_EQ(by_runtime.model().hash, by_opencv.model().hash);
  const auto a = by_opencv.infer(frame()), b = by_runtime.infer(frame());
  ASSERT_TRUE(a && b);
  ASSERT_GT(a->detections.size(), 0U);
  ASSERT_EQ(a->detections.size(), b->detections.size());
  for (std::size_t i = 0; i < a->detections.size(); ++i) {
    EXPECT_NEAR(a->detections[i].box.x1, b->detections[i].box.x1, 1e-3);
    EXPECT_NEAR(a->detections[i].box.y2, b->detections[i].box.y2, 1e-3);
    EXPECT_THAT(b->detections[i].activations,
                ::testing::Pointwise(::testing::FloatNear(1e-4F), a->detections[i].activations));
  }
}

TEST_F(OnnxRuntime, ComputesTheCommittedNetworkAsOpenCvDoes) {
  const char* source = std::getenv("PERDURE_SOURCE");
  Config config;
  config.model.path =
      (std::filesystem::path(source ? source : ".") / "models" / "perdure_320x240.onnx").string();
  config.model.backend = "opencv";
  Node by_opencv(config, 1);
  config.model.backend = "onnxruntime";
  Node by_runtime(config, 1);
  const auto a = by_opencv.candidatesIn(frame(), 0.001),
             b = by_runtime.candidatesIn(frame(), 0.001);
  ASSERT_TRUE(a && b);
  ASSERT_GT(a->size(), 0U);
  ASSERT_EQ(a->size(), b->size());
  for (std::size_t i = 0; i < a->size(); ++i) {
    EXPECT_NEAR((*a)[i].box.x1, (*b)[i].box.x1, 0.01);
    EXPECT_NEAR((*a)[i].score, (*b)[i].score, 1e-4);
  }
}

TEST_F(OnnxRuntime, TakesWhatOpenCvDoesNot) {
  testing::TinyOnnx net;
  Node plain(config(net, "opencv"), 1);
  net.for_other_runtimes = true;
  net.name = "other";
  Node node(config(net, "auto"), 1);
  EXPECT_THAT(node.backend(), HasSubstr("ONNX Runtime"));
  EXPECT_EQ(node.infer(frame())->detections.size(), plain.infer(frame())->detections.size());
}

TEST_F(OnnxRuntime, SaysWhatIsWrongWithAFile) {
  const Config c = config({}, "onnxruntime");
  std::string description = testing::TinyOnnx().json();
  description.replace(description.find("box32"), 5, "box99");
  std::ofstream(c.model.path + ".model.json") << description;
  EXPECT_THAT(error(c), HasSubstr("finds no output named box99"));
  std::filesystem::resize_file(c.model.path, std::filesystem::file_size(c.model.path) / 2);
  EXPECT_THAT(error(c), HasSubstr("ONNX Runtime does not take it"));
}

}  // namespace
}  // namespace perdure::inference
