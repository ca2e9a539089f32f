// A network from a file, run by OpenCV's DNN module, or ONNX Runtime if this build has it.
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

/// Backend of a name, which must be "auto", "opencv" or "onnxruntime".
Backend backendOf(const std::string& name);

bool hasOnnxRuntime();

struct NetworkFile {
  std::string bytes;              ///< contents of an .onnx, or of a Darknet .cfg
  std::string darknet_weights;    ///< contents of its .weights; empty: ONNX
  bool for_onnx_runtime = false;  ///< whether the description requires ONNX Runtime
};

class Network {
 public:
  virtual ~Network() = default;

  /// `blob` is (1,3,H,W), float32. The tensors are valid until the next call. Fails with
  /// "model_failed" if the network could not be evaluated, or with "model_output_shape".
  virtual Result<std::vector<Tensor>> forward(const cv::Mat& blob) = 0;
  virtual std::string backend() const = 0;
};

/// `threads`: threads of ONNX Runtime; OpenCV uses those of the process (cv::setNumThreads). Fails
/// with "model_unreadable", "model_without_tensor" or "backend_absent". The detail is a clause that
/// names the backend and the cause.
Result<std::unique_ptr<Network>> loadNetwork(const NetworkFile& file,
                                             const std::vector<std::string>& tensors,
                                             Backend backend = Backend::kAuto, int threads = 1);

/// Loaders of single backends, for loadNetwork().
Result<std::unique_ptr<Network>> loadWithOpenCv(const NetworkFile& file,
                                                const std::vector<std::string>& tensors);
Result<std::unique_ptr<Network>> loadWithOnnxRuntime(const NetworkFile& file,
                                                     const std::vector<std::string>& tensors,
                                                     int threads);

}  // namespace perdure::inference
