// A network of a file, asked for named raw tensors: OpenCV's DNN module computes it, or ONNX
// Runtime where this build has it.
#pragma once

#include <memory>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "services/inference/core/network/tensors.h"

namespace perdure::inference {

enum class Backend {
  kAuto,  ///< ONNX Runtime for a file that is for it; else OpenCV, and where it does not take the
          ///< file ONNX Runtime
  kOpenCv,
  kOnnxRuntime,
};

/// "auto", "opencv", "onnxruntime"; precondition: one of them.
Backend backendOf(const std::string& name);

/// Whether this build has ONNX Runtime.
bool hasOnnxRuntime();

struct NetworkFile {
  std::string bytes;              ///< of an .onnx, or of a Darknet .cfg
  std::string darknet_weights;    ///< bytes of its .weights; empty: ONNX
  bool for_onnx_runtime = false;  ///< as its description says
};

class Network {
 public:
  virtual ~Network() = default;

  /// `blob` is (1,3,H,W), float32. The tensors live until the next call.
  /// Reasons: "model_failed" where the network could not be computed, "model_output_shape".
  virtual Result<std::vector<Tensor>> forward(const cv::Mat& blob) = 0;
  /// What computes it, with its version, for people.
  virtual std::string backend() const = 0;
};

/// `threads` are those of ONNX Runtime; OpenCV's are the process's (cv::setNumThreads).
/// Reasons: "model_unreadable", "model_without_tensor", "backend_absent"; the detail is a clause
/// that says who does not take it and why.
Result<std::unique_ptr<Network>> loadNetwork(const NetworkFile& file,
                                             const std::vector<std::string>& tensors,
                                             Backend backend = Backend::kAuto, int threads = 1);

/// Of one backend each, for loadNetwork().
Result<std::unique_ptr<Network>> loadWithOpenCv(const NetworkFile& file,
                                                const std::vector<std::string>& tensors);
Result<std::unique_ptr<Network>> loadWithOnnxRuntime(const NetworkFile& file,
                                                     const std::vector<std::string>& tensors,
                                                     int threads);

}  // namespace perdure::inference
