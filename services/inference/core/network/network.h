// Runs a network from a file, by OpenCV's DNN module or by ONNX Runtime if this build has it.
#pragma once

#include <memory>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "services/inference/core/network/tensors.h"

namespace perdure::inference {

enum class Backend {
  kAuto,  ///< ONNX Runtime if the description requires it; otherwise OpenCV, or ONNX Runtime if
          ///< OpenCV rejects the file
  kOpenCv,
  kOnnxRuntime,
};

/// Returns the backend of a name, which must be "auto", "opencv" or "onnxruntime".
Backend backendOf(const std::string& name);

bool hasOnnxRuntime();

struct NetworkFile {
  std::string bytes;              ///< contents of an .onnx, or of a Darknet .cfg
  std::string darknet_weights;    ///< contents of the .weights; empty for ONNX
  bool for_onnx_runtime = false;  ///< true if the description requires ONNX Runtime
};

class Network {
 public:
  virtual ~Network() = default;

  /// Evaluates the network for `blob`, (1,3,H,W) of float32. The tensors are valid until the next
  /// call. Fails with "model_failed" if the network could not be evaluated, or with
  /// "model_output_shape".
  virtual Result<std::vector<Tensor>> forward(const cv::Mat& blob) = 0;
  virtual std::string backend() const = 0;
};

/// Loads a network that will output `tensors`. `threads` is for ONNX Runtime; OpenCV uses the
/// process's setting (cv::setNumThreads). Fails with "model_unreadable", "model_without_tensor" or
/// "backend_absent". The detail is a clause that names the backend and the cause.
Result<std::unique_ptr<Network>> loadNetwork(const NetworkFile& file,
                                             const std::vector<std::string>& tensors,
                                             Backend backend = Backend::kAuto, int threads = 1);

/// Load a network with one backend. They are called by loadNetwork().
Result<std::unique_ptr<Network>> loadWithOpenCv(const NetworkFile& file,
                                                const std::vector<std::string>& tensors);
Result<std::unique_ptr<Network>> loadWithOnnxRuntime(const NetworkFile& file,
                                                     const std::vector<std::string>& tensors,
                                                     int threads);

}  // namespace perdure::inference
