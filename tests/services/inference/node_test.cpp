#include "services/inference/node.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>

#include "common/base/errors.h"
#include "tests/services/inference/tiny_model.h"

namespace perdure::inference {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class NodeTest : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() /
              ("perdure_inference_" + std::to_string(getpid()) + "_" +
               ::testing::UnitTest::GetInstance()->current_test_info()->name());
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  Config config(const testing::TinyModel& model = {}) {
    Config c;
    c.model.path = model.write(folder_);
    c.detection.merge_iou = 0.9;
    return c;
  }
  static Frame frame() {
    Frame f;
    f.stamp.source = 7;
    f.stamp.sequence = 3;
    f.camera = "cam0";
    f.width = 128;
    f.height = 96;
    f.encoding = ImageEncoding::kMono8;
    f.data = std::make_shared<const std::vector<std::uint8_t>>(128 * 96, std::uint8_t{9});
    return f;
  }
  /// Returns the code and the message of the StartupError that the construction of a node throws.
  static std::pair<ExitCode, std::string> error(const Config& c) {
    try {
      Node node(c, 1);
    } catch (const StartupError& e) {
      return {e.code(), e.what()};
    }
    return {ExitCode::kOk, "no error"};
  }

  fs::path folder_;
};

TEST_F(NodeTest, GivesTheKnownAnswerOfATinyNetworkInPixelsOfTheImage) {
  Node node(config(), 42);
  const auto out = node.infer(frame());
  ASSERT_TRUE(out) << out.error().detail;
  EXPECT_TRUE(out->stamp.sameFrame(frame().stamp));
  EXPECT_EQ(out->camera, "cam0");
  EXPECT_EQ(out->instance, 42u);
  EXPECT_EQ(out->model_hash, node.model().hash);
  ASSERT_EQ(out->detections.size(), 4u) << "one for each of the 2×2 cells";
  const Detection& d = out->detections[0];  // cell (0, 0): centre 16,16 of 64×64, size 16×8
  EXPECT_NEAR(d.box.x1, (16 - 8) * 2.0, 1e-4);
  EXPECT_NEAR(d.box.x2, (16 + 8) * 2.0, 1e-4);
  EXPECT_NEAR(d.box.y1, (16 - 4) * 1.5, 1e-4);
  EXPECT_NEAR(d.box.y2, (16 + 4) * 1.5, 1e-4);
  const double p = 1 / (1 + std::exp(-2.0)) / (1 + std::exp(-3.0));
  ASSERT_EQ(d.activations.size(), 3u);
  EXPECT_NEAR(d.activations[1], std::log(p / (1 - p)), 1e-4);
}

TEST_F(NodeTest, SaysWhatItsActivationsMean) {
  const Node node(config(), 42);
  EXPECT_EQ(node.model().classes, (std::vector<std::string>{"car", "person"}));
  EXPECT_EQ(node.model().name, "tiny");
  EXPECT_EQ(node.model().input_width, 64u);
  EXPECT_NE(node.model().hash, 0u);
}

TEST_F(NodeTest, HashFollowsWeightsAndDescription) {
  const auto hash = [&](const testing::TinyModel& m, std::vector<std::string> classes = {}) {
    Config c = config(m);
    c.detection.classes = std::move(classes);
    return Node(c, 1).model().hash;
  };
  testing::TinyModel other_weights, other_description;
  other_weights.head[4] = 2.5F;
  other_description.anchor_width = 17;
  const auto base = hash({});
  EXPECT_EQ(hash({}), base);
  EXPECT_NE(hash(other_weights), base);
  EXPECT_NE(hash(other_description), base);
  EXPECT_NE(hash({}, {"car"}), base);
}

/// A camera with the body's axes.
perdure::Calibration rig() {
  perdure::Calibration rig;
  rig.cameras.emplace_back().name = "cam0";
  return rig;
}

Odometry upAt(const Eigen::Vector3d& up) {
  Odometry odometry;
  odometry.state = OdometryState::kTracking;
  odometry.up_W = up;
  return odometry;
}

TEST_F(NodeTest, TurnsImagesByTheOdometryAndBoxesAndInsetsBack) {
  const Config c = config();
  std::string json = testing::TinyModel{}.json();
  json.insert(1, R"("side_insets": {"car": [0.01, 0.02, 0.03, 0.04]},)");
  std::ofstream(c.model.path + ".model.json") << json;
  Node node(c, 42);
  node.onCalibration(rig());
  const auto plain = node.infer(frame());
  ASSERT_TRUE(plain);
  const std::uint64_t hash = node.model().hash;
  EXPECT_EQ(node.model().name, "tiny");
  Odometry first = upAt({-1, 0, 0});
  first.state = OdometryState::kInitialising;
  node.onOdometry(first);
  EXPECT_EQ(node.infer(frame())->model_hash, hash) << "this odometry says nothing yet";

  node.onOdometry(upAt({-1, 0, 0}));
  const auto turned = node.infer(frame());
  ASSERT_TRUE(turned);
  EXPECT_NE(turned->model_hash, hash);
  EXPECT_EQ(turned->model_hash, node.model().hash);
  EXPECT_EQ(node.model().name, "tiny, turned by 90°");
  // Left of the network's picture is the bottom of the image.
  EXPECT_EQ(node.model().side_insets, (std::vector<double>{0.02, 0.03, 0.04, 0.01, 0, 0, 0, 0}));
  ASSERT_EQ(turned->detections.size(), 4u);
  const Box box = turned->detections[0].box;  // centre 16,16 of 64×64, size 16×8; image 96×128
  EXPECT_NEAR(box.x1, (16 - 4) * 2.0, 1e-4);
  EXPECT_NEAR(box.x2, (16 + 4) * 2.0, 1e-4);
  EXPECT_NEAR(box.y1, 96 - (16 + 8) * 1.5, 1e-4);
  EXPECT_NEAR(box.y2, 96 - (16 - 8) * 1.5, 1e-4);

  node.onOdometry(upAt({0, -1, 0}));
  const auto again = node.infer(frame());
  ASSERT_TRUE(again);
  EXPECT_EQ(again->model_hash, hash);
  EXPECT_EQ(again->detections[0].box.x1, plain->detections[0].box.x1);
}

TEST_F(NodeTest, AModelMayForbidTheTurnAndTheConfigurationMayFixIt) {
  Config c = config();
  std::string json = testing::TinyModel{}.json();
  json.insert(1, R"("upright": false,)");
  std::ofstream(c.model.path + ".model.json") << json;
  Node forbidden(c, 1);
  forbidden.onCalibration(rig());
  forbidden.onOdometry(upAt({0, 1, 0}));
  ASSERT_TRUE(forbidden.infer(frame()));
  EXPECT_EQ(forbidden.model().name, "tiny");
  c.detection.turn = "180";
  Node fixed(c, 1);
  ASSERT_TRUE(fixed.infer(frame())) << "without odometry";
  EXPECT_EQ(fixed.model().name, "tiny, turned by 180°");
}

TEST_F(NodeTest, RefusesAMalformedFrameAndGoesOn) {
  Node node(config(), 1);
  Frame bad = frame();
  bad.width = 4000;
  ASSERT_FALSE(node.infer(bad));
  EXPECT_EQ(node.infer(bad).error().code, "frame_malformed");
  EXPECT_TRUE(node.infer(frame()));
}

TEST_F(NodeTest, SaysWhichFileIsMissing) {
  Config c;
  EXPECT_EQ(error(c).first, ExitCode::kConfiguration);
  c.model.path = (folder_ / "none.onnx").string();
  EXPECT_EQ(error(c).first, ExitCode::kUnavailable);
  EXPECT_THAT(error(c).second, HasSubstr("none.onnx is missing"));
  c.model.path = folder_.string();
  EXPECT_THAT(error(c).second, HasSubstr("is a folder"));
  c = config();
  fs::remove(folder_ / "tiny.weights");
  EXPECT_EQ(error(c).first, ExitCode::kUnavailable);
  EXPECT_THAT(error(c).second, HasSubstr("tiny.weights"));
}

TEST_F(NodeTest, SaysWhereItLookedForADescription) {
  Config c = config();
  fs::remove(folder_ / "tiny.cfg.model.json");
  const auto [code, message] = error(c);
  EXPECT_EQ(code, ExitCode::kUnavailable);
  EXPECT_THAT(message, HasSubstr("tiny.cfg.model.json"));
  EXPECT_THAT(message, HasSubstr("model.description"));
  EXPECT_THAT(message, HasSubstr("services/inference/model_json.md"));
}

TEST_F(NodeTest, RefusesAFileThatIsNotANetwork) {
  Config c = config();
  for (const char* content : {"hello", "\x08\x07\x12", "GIF89a nothing of the kind"}) {
    const auto path = folder_ / "not.onnx";
    std::ofstream(path) << content;
    c.model.path = path.string();
    c.model.description = (folder_ / "tiny.cfg.model.json").string();
    EXPECT_EQ(error(c).first, ExitCode::kConfiguration) << content;
    EXPECT_THAT(error(c).second, HasSubstr("not.onnx"));
  }
}

TEST_F(NodeTest, RefusesTruncatedWeights) {
  const Config c = config();
  for (const std::size_t size : {3u, 20u, 40u, 100u}) {
    fs::resize_file(folder_ / "tiny.weights", size);
    const auto [code, message] = error(c);
    EXPECT_EQ(code, ExitCode::kConfiguration) << size << ": " << message;
  }
}

TEST_F(NodeTest, RefusesADescriptionThatDoesNotFit) {
  testing::TinyModel one_class;
  one_class.classes_in_json = 1;
  EXPECT_EQ(error(config(one_class)).first, ExitCode::kConfiguration);
  EXPECT_THAT(error(config(one_class)).second, HasSubstr("permute_1 is 1x2x2x7, not 1x2x2x6"));
  Config c = config();
  c.detection.classes = {"cat"};
  EXPECT_THAT(error(c).second, HasSubstr("knows no class \"cat\""));
}

TEST_F(NodeTest, NamesATensorThatTheNetworkHasNot) {
  Config c = config();
  std::string json = testing::TinyModel{}.json();
  json.replace(json.find("permute_1"), 9, "permute_9");
  std::ofstream(c.model.path + ".model.json") << json;
  EXPECT_EQ(error(c).first, ExitCode::kConfiguration);
  EXPECT_THAT(error(c).second, HasSubstr("no layer named permute_9"));
  EXPECT_THAT(error(c).second, HasSubstr("permute_1"));
}

TEST(ModelDescription, TellsAllFaultsAtOnce) {
  const std::string json = R"({"family": "yolov9", "input": {"width": "wide", "height": 64,
    "fit": "resize", "colour": "bgr", "pads": 3}, "classes": ["car", "Car"],
    "activation": {"class": "sigmoid"}, "calibration": {"temperature": 0},
    "levels": [{"stride": 7, "box": "b", "objectness": "o", "classes": "c"}]})";
  try {
    parseModelDescription(json, "m.json");
    FAIL() << "it was taken";
  } catch (const StartupError& e) {
    EXPECT_EQ(e.code(), ExitCode::kConfiguration);
    for (const char* part : {"yolov9", "input.width", "input.pads", "\"car\" is there twice",
                             "calibration.temperature", "levels[0].stride"}) {
      EXPECT_THAT(e.what(), HasSubstr(part));
    }
  }
  EXPECT_THROW(parseModelDescription("{", "m.json"), StartupError);
  EXPECT_THROW(parseModelDescription("[1]", "m.json"), StartupError);
  EXPECT_THROW(parseModelDescription(R"({"family": 3, "classes": 5})", "m.json"), StartupError);
}

TEST(Lease, IsThreePeriodsAndNeverUnderATenthOfASecond) {
  EXPECT_DOUBLE_EQ(leaseSeconds({10, false, 0.1}), 0.3);
  EXPECT_DOUBLE_EQ(leaseSeconds({10, false, 0.01}), 0.1);
}

}  // namespace
}  // namespace perdure::inference
