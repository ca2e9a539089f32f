#include "services/inference/core/network/network.h"

#include "common/base/check.h"

namespace perdure::inference {

Backend backendOf(const std::string& name) {
  if (name == "opencv") return Backend::kOpenCv;
  if (name == "onnxruntime") return Backend::kOnnxRuntime;
  check(name == "auto", "a backend that there is");
  return Backend::kAuto;
}

#ifdef PERDURE_ONNX_RUNTIME
bool hasOnnxRuntime() { return true; }
#else
bool hasOnnxRuntime() { return false; }

Result<std::unique_ptr<Network>> loadWithOnnxRuntime(const NetworkFile&,
                                                     const std::vector<std::string>&, int) {
  return fail("backend_absent", "this program was built where ONNX Runtime was not installed");
}
#endif

Result<std::unique_ptr<Network>> loadNetwork(const NetworkFile& file,
                                             const std::vector<std::string>& tensors,
                                             Backend backend, int threads) {
  if (backend == Backend::kAuto && file.for_onnx_runtime) backend = Backend::kOnnxRuntime;
  if (backend == Backend::kOnnxRuntime) return loadWithOnnxRuntime(file, tensors, threads);
  auto by_opencv = loadWithOpenCv(file, tensors);
  const bool other = backend == Backend::kAuto && hasOnnxRuntime() && file.darknet_weights.empty();
  if (by_opencv || !other) return by_opencv;
  auto by_runtime = loadWithOnnxRuntime(file, tensors, threads);
  if (by_runtime) return by_runtime;
  return fail(by_runtime.error().code, by_opencv.error().detail + "; " + by_runtime.error().detail);
}

}  // namespace perdure::inference
