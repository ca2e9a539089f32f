// A network loaded by OpenCV's DNN module, asked for named raw tensors.
#pragma once

#include <opencv2/dnn.hpp>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "services/inference/core/decode.h"

namespace perdure::inference {

class Network {
 public:
  /// An ONNX file (empty `darknet_weights`), or a Darknet .cfg with its .weights, as bytes.
  /// Reasons: "model_unreadable", "model_without_tensor"; the detail is a sentence.
  static Result<Network> load(const std::string& file, const std::string& darknet_weights,
                              std::vector<std::string> tensors);

  /// `blob` is (1,3,H,W), float32. The tensors live until the next call.
  /// Reasons: "model_failed" where OpenCV could not compute the network.
  Result<std::vector<Tensor>> forward(const cv::Mat& blob);

 private:
  Network(cv::dnn::Net net, std::vector<std::string> tensors);

  cv::dnn::Net net_;
  std::vector<std::string> names_;
  std::vector<cv::Mat> outputs_;
};

}  // namespace perdure::inference
