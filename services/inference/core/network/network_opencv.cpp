#include <algorithm>
#include <opencv2/core/utils/logger.hpp>
#include <opencv2/dnn.hpp>

#include "services/inference/core/network/network.h"

namespace perdure::inference {
namespace {

/// Prevents OpenCV from printing the errors that it also throws.
class QuietOpenCv {
 public:
  QuietOpenCv() : before_(cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT)) {}
  ~QuietOpenCv() { cv::utils::logging::setLogLevel(before_); }
  QuietOpenCv(const QuietOpenCv&) = delete;
  QuietOpenCv& operator=(const QuietOpenCv&) = delete;

 private:
  cv::utils::logging::LogLevel before_;
};

/// Summarises an OpenCV exception in one line: the unsupported operator if the text names one (">
/// Node [Where@ai.onnx]:(onnx_node!Where_2) parse error …"), otherwise the first line.
std::string gist(const std::string& text) {
  const std::size_t begin = text.find("Node ["), end = text.find_first_of("@]", begin);
  if (begin != std::string::npos && end != std::string::npos) {
    return "OpenCV does not take its operator " + text.substr(begin + 6, end - begin - 6);
  }
  return text.substr(0, text.find('\n'));
}

std::string lastOf(const std::vector<std::string>& names, std::size_t count) {
  std::string text;
  for (std::size_t i = names.size() - std::min(count, names.size()); i < names.size(); ++i) {
    text += (text.empty() ? "" : ", ") + names[i];
  }
  return text;
}

/// Checks the size of a .weights file, because OpenCV reads past its end without an error.
Result<void> checkWeights(cv::dnn::Net& net, std::size_t bytes) {
  std::size_t needed = 0;
  for (const std::string& name : net.getLayerNames()) {
    const auto layer = net.getLayer(net.getLayerId(name));
    if (layer->type == "Region") continue;  // its blobs are anchors, which come from the .cfg
    for (const cv::Mat& blob : layer->blobs) needed += blob.total() * sizeof(float);
  }
  constexpr std::size_t kHeader = 16;  // bytes; 20 since Darknet 0.2
  if (bytes >= needed + kHeader) return {};
  return fail("model_unreadable", "its .weights has " + std::to_string(bytes) + " bytes and the " +
                                      ".cfg needs " + std::to_string(needed + kHeader));
}

class OpenCvNetwork : public Network {
 public:
  OpenCvNetwork(cv::dnn::Net net, std::vector<std::string> tensors)
      : net_(std::move(net)), names_(std::move(tensors)) {}

  Result<std::vector<Tensor>> forward(const cv::Mat& blob) override {
    const QuietOpenCv quiet;
    try {
      net_.setInput(blob);
      net_.forward(outputs_, names_);
    } catch (const std::exception& e) {
      return fail("model_failed", gist(e.what()));
    }
    std::vector<Tensor> tensors;
    for (cv::Mat& output : outputs_) {
      if (output.type() != CV_32F) return fail("model_output_shape", "an output is not float32");
      if (!output.isContinuous()) output = output.clone();
      tensors.push_back(
          {{output.size.p, output.size.p + output.dims}, {output.ptr<float>(), output.total()}});
    }
    return tensors;
  }

  std::string backend() const override { return "OpenCV " + cv::getVersionString(); }

 private:
  cv::dnn::Net net_;
  std::vector<std::string> names_;
  std::vector<cv::Mat> outputs_;
};

}  // namespace

Result<std::unique_ptr<Network>> loadWithOpenCv(const NetworkFile& file,
                                                const std::vector<std::string>& tensors) {
  const QuietOpenCv quiet;
  const std::string& weights = file.darknet_weights;
  cv::dnn::Net net;
  try {
    net = weights.empty() ? cv::dnn::readNetFromONNX(file.bytes.data(), file.bytes.size())
                          : cv::dnn::readNetFromDarknet(file.bytes.data(), file.bytes.size(),
                                                        weights.data(), weights.size());
  } catch (const std::exception& e) {  // cv::Exception, and exceptions of protobuf and std
    return fail("model_unreadable", gist(e.what()));
  }
  if (net.empty()) return fail("model_unreadable", "it has no layers");
  if (!weights.empty()) {
    if (const auto whole = checkWeights(net, weights.size()); !whole) {
      return tl::unexpected(whole.error());
    }
  }
  const std::vector<std::string> layers = net.getLayerNames();
  for (const std::string& name : tensors) {
    if (std::find(layers.begin(), layers.end(), name) == layers.end()) {
      return fail("model_without_tensor",
                  "it has no layer named " + name + "; its last layers are " + lastOf(layers, 8));
    }
  }
  net.setPreferableBackend(cv::dnn::DNN_BACKEND_OPENCV);
  net.setPreferableTarget(cv::dnn::DNN_TARGET_CPU);
  return std::make_unique<OpenCvNetwork>(std::move(net), tensors);
}

}  // namespace perdure::inference
