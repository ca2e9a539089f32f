// Tests real networks on real images, if they are present.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <opencv2/dnn.hpp>
#include <opencv2/imgcodecs.hpp>
#include <sstream>

#include "common/base/errors.h"
#include "services/inference/core/decode/evidence.h"
#include "services/inference/core/network/image_fit.h"
#include "services/inference/node.h"

namespace perdure::inference {
namespace {

namespace fs = std::filesystem;

fs::path source() {
  const char* folder = std::getenv("PERDURE_SOURCE");
  return folder ? folder : ".";
}

fs::path data() { return source() / "../shared/data"; }

struct Label {
  std::string type;
  int truncated = 0, occluded = 0;
  Box box;
};

std::vector<Label> labelsOf(int wanted) {
  std::ifstream in(data() / "kitti_tracking/label_02/0000.txt");
  std::vector<Label> labels;
  for (std::string line; std::getline(in, line);) {
    std::istringstream words(line);
    int frame = 0, track = 0;
    double alpha = 0;
    Label label;
    words >> frame >> track >> label.type >> label.truncated >> label.occluded >> alpha;
    words >> label.box.x1 >> label.box.y1 >> label.box.x2 >> label.box.y2;
    if (frame == wanted) labels.push_back(label);
  }
  return labels;
}

Frame frameOf(int index) {
  char name[32];
  std::snprintf(name, sizeof name, "%010d.jpg", index);
  const cv::Mat pixels = cv::imread(
      (data() / "kitti_raw/2011_09_26/2011_09_26_drive_0005_sync/image_02/data" / name).string(),
      cv::IMREAD_COLOR);
  Frame frame;
  frame.camera = "cam0";
  frame.width = static_cast<std::uint32_t>(pixels.cols);
  frame.height = static_cast<std::uint32_t>(pixels.rows);
  frame.encoding = ImageEncoding::kBgr8;
  frame.data = std::make_shared<const std::vector<std::uint8_t>>(pixels.data,
                                                                 pixels.data + pixels.total() * 3);
  return frame;
}

/// Returns the network's best log-odds for any of `names` at the box `truth`; -100 if no box is
/// there.
double oddsAt(const Detections& detections, const Node& node, const std::vector<std::string>& names,
              const Box& truth) {
  const ModelInfo& model = node.model();
  double best = -100;
  for (const std::string& name : names) {
    const auto it = std::find(model.classes.begin(), model.classes.end(), name);
    const auto k = static_cast<std::size_t>(it - model.classes.begin()) + 1;
    for (const Detection& d : detections.detections) {
      if (intersectionOverUnion(d.box, truth) < 0.5) continue;
      const double evidence = double{d.activations[k]} - d.activations[0];
      best = std::max(best, oddsOf(node.description().calibration, evidence));
    }
  }
  return best;
}

/// Threshold of the network's own log-odds (a score of 0.035) above which a car counts as found. It
/// does not depend on the calibration.
constexpr double kSeen = -3.3;

struct Expectation {
  const char* file;
  double recall;  ///< lower bound of the measured recall of near cars over the tested frames
};

class Networks : public ::testing::TestWithParam<Expectation> {
 protected:
  void SetUp() override {
    model_ = data() / "weights" / GetParam().file;
    if (!fs::exists(model_)) GTEST_SKIP() << "../shared/data is absent: no network to try";
    config_.model.path = model_.string();
    config_.model.description =
        (source() / "config/models" / (model_.stem().string() + ".json")).string();
  }
  fs::path model_;
  Config config_;
};

TEST_P(Networks, FindTheLabelledCarsOfTheRealDrive) {
  Node node(config_, 1);
  int cars = 0, found = 0;
  for (const int index : {0, 20, 40, 60, 80, 100, 120, 140}) {
    const auto out = node.infer(frameOf(index));
    ASSERT_TRUE(out) << out.error().detail;
    for (const Label& label : labelsOf(index)) {
      const bool car = label.type == "Car" || label.type == "Van";
      if (!car || label.truncated || label.occluded || label.box.height() < 40) continue;
      ++cars;
      found += oddsAt(*out, node, {"car", "truck"}, label.box) > kSeen;
    }
  }
  EXPECT_GE(found, GetParam().recall * cars);
}

TEST_P(Networks, SeeTheVanOfTheFirstFrameAndAnswerTheSameTwice) {
  Node node(config_, 1);
  const auto out = node.infer(frameOf(0));
  ASSERT_TRUE(out) << out.error().detail;
  const Box van = labelsOf(0).at(2).box;
  EXPECT_GT(oddsAt(*out, node, {"car", "truck"}, van), kSeen);
  const auto again = node.infer(frameOf(0));
  ASSERT_TRUE(again);
  ASSERT_EQ(again->detections.size(), out->detections.size());
  for (std::size_t i = 0; i < out->detections.size(); ++i) {
    EXPECT_EQ(again->detections[i].activations, out->detections[i].activations);
  }
}

TEST_P(Networks, RefuseToLoadWhenTruncated) {
  const fs::path folder = fs::temp_directory_path() / ("perdure_cut_" + std::to_string(getpid()));
  fs::create_directories(folder);
  const fs::path cut = folder / model_.filename();
  const bool darknet = model_.extension() == ".cfg";
  fs::copy_file(model_, cut, fs::copy_options::overwrite_existing);
  fs::path shortened = cut;
  if (darknet) {
    shortened.replace_extension(".weights");
    fs::copy_file(fs::path(model_).replace_extension(".weights"), shortened,
                  fs::copy_options::overwrite_existing);
  }
  fs::permissions(shortened, fs::perms::owner_all);
  config_.model.path = cut.string();
  const auto size = fs::file_size(shortened);
  for (const double part : {0.001, 0.5, 0.97}) {
    fs::resize_file(shortened, static_cast<std::uintmax_t>(part * static_cast<double>(size)));
    EXPECT_THROW(Node(config_, 1), StartupError) << part;
    fs::copy_file(darknet ? fs::path(model_).replace_extension(".weights") : model_, shortened,
                  fs::copy_options::overwrite_existing);
    fs::permissions(shortened, fs::perms::owner_all);
  }
  fs::remove_all(folder);
}

INSTANTIATE_TEST_SUITE_P(All, Networks,
                         ::testing::Values(Expectation{"yolox_nano_416.onnx", 0.95},
                                           Expectation{"yolo-fastest-1.1.cfg", 0.75},
                                           Expectation{"yolo-fastest-1.1-xl.cfg", 0.85},
                                           Expectation{"FastestDet_352_coco.onnx", 0.95}),
                         [](const auto& network) {
                           std::string name = fs::path(network.param.file).stem().string();
                           std::replace_if(
                               name.begin(), name.end(), [](char c) { return !std::isalnum(c); },
                               '_');
                           return name;
                         });

/// Returns the rows of the network's own activated output, computed by OpenCV without Perdure's
/// decoding.
cv::Mat activatedRows(const fs::path& model, const Input& input, const Frame& frame) {
  cv::dnn::Net net = cv::dnn::readNet(model.string());
  net.setPreferableBackend(cv::dnn::DNN_BACKEND_OPENCV);
  net.setInput(*makeBlob(input, frame));
  cv::Mat out = net.forward();
  return out.reshape(1, static_cast<int>(out.total()) / 85).clone();
}

TEST(RawTensors, AgreeWithTheActivatedOutputOfYolox) {
  const fs::path model = data() / "weights/yolox_nano_416.onnx";
  if (!fs::exists(model)) GTEST_SKIP() << "../shared/data is absent: no network to try";
  const ModelFile file =
      readModelFile(model.string(), (source() / "config/models/yolox_nano_416.json").string(), {});
  const Frame frame = frameOf(60);
  const cv::Mat rows = activatedRows(model, file.description.input, frame);
  auto network = loadNetwork({file.network, ""}, tensorNames(file.description));
  ASSERT_TRUE(network);
  const auto tensors = (*network)->forward(*makeBlob(file.description.input, frame));
  ASSERT_TRUE(tensors);
  int row = 0;
  double worst = 0;
  for (std::size_t level = 0; level < 3; ++level) {
    const Tensor &box = (*tensors)[3 * level], &objectness = (*tensors)[3 * level + 1],
                 &classes = (*tensors)[3 * level + 2];
    const std::size_t cells = objectness.values.size();
    for (std::size_t i = 0; i < cells; ++i, ++row) {
      const float* out = rows.ptr<float>(row);
      for (std::size_t k = 0; k < 4; ++k) {
        worst = std::max(worst, std::abs(double{out[k]} - box.values[k * cells + i]));
      }
      worst = std::max(worst, std::abs(out[4] - sigmoid(objectness.values[i])));
      for (std::size_t k = 0; k < 80; ++k) {
        worst = std::max(worst, std::abs(out[5 + k] - sigmoid(classes.values[k * cells + i])));
      }
    }
  }
  EXPECT_EQ(row, rows.rows);
  EXPECT_LT(worst, 1e-5);
}

}  // namespace
}  // namespace perdure::inference
