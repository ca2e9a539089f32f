#include <onnxruntime_cxx_api.h>

#include <algorithm>
#include <array>

#include "common/base/process/held_errors.h"
#include "services/inference/core/network/network.h"

namespace perdure::inference {
namespace {

constexpr const char* kWho = "ONNX Runtime ";

/// Returns the environment of the process. It does not log errors, because they are also thrown.
Ort::Env& environment() {
  static Ort::Env env(ORT_LOGGING_LEVEL_FATAL, "perdure");
  return env;
}

std::string gist(const std::string& text) {
  constexpr std::size_t kLong = 200;
  return text.substr(0, std::min(text.find('\n'), kLong));
}

bool isFloatTensor(const Ort::TypeInfo& type) {
  return type.GetONNXType() == ONNX_TYPE_TENSOR &&
         type.GetTensorTypeAndShapeInfo().GetElementType() == ONNX_TENSOR_ELEMENT_DATA_TYPE_FLOAT;
}

Ort::SessionOptions optionsOf(int threads) {
  Ort::SessionOptions options;
  options.SetIntraOpNumThreads(threads);
  options.SetInterOpNumThreads(1);
  // Waiting threads sleep, because other services need the CPU cores.
  options.AddConfigEntry("session.intra_op.allow_spinning", "0");
  return options;
}

class OnnxRuntimeNetwork : public Network {
 public:
  OnnxRuntimeNetwork(const std::string& file, std::vector<std::string> tensors, int threads)
      : session_(environment(), file.data(), file.size(), optionsOf(threads)),
        names_(std::move(tensors)) {
    for (const std::string& name : names_) name_pointers_.push_back(name.c_str());
  }

  Result<void> suits() {
    Ort::AllocatorWithDefaultOptions allocator;
    if (session_.GetInputCount() != 1) {
      return fail("model_unreadable", kWho + ("takes " + std::to_string(session_.GetInputCount())) +
                                          " inputs for it, and there is one image");
    }
    if (!isFloatTensor(session_.GetInputTypeInfo(0))) {
      return fail("model_unreadable", kWho + std::string("wants an input that is not float32"));
    }
    input_ = session_.GetInputNameAllocated(0, allocator).get();
    std::vector<std::string> outputs;
    for (std::size_t i = 0; i < session_.GetOutputCount(); ++i) {
      outputs.emplace_back(session_.GetOutputNameAllocated(i, allocator).get());
    }
    for (const std::string& name : names_) {
      const auto it = std::find(outputs.begin(), outputs.end(), name);
      if (it == outputs.end()) return fail("model_without_tensor", absent(name, outputs));
      const auto index = static_cast<std::size_t>(it - outputs.begin());
      if (!isFloatTensor(session_.GetOutputTypeInfo(index))) {
        return fail("model_output_shape", kWho + ("gives an output that is not float32: " + name));
      }
    }
    return {};
  }

  Result<std::vector<Tensor>> forward(const cv::Mat& blob) override {
    const std::array<std::int64_t, 4> shape = {blob.size[0], blob.size[1], blob.size[2],
                                               blob.size[3]};
    const char* input = input_.c_str();
    try {
      // The runtime does not write to an input, but its interface has no const.
      const Ort::Value image = Ort::Value::CreateTensor<float>(
          memory_, const_cast<float*>(blob.ptr<float>()), blob.total(), shape.data(), shape.size());
      outputs_ = session_.Run(Ort::RunOptions{nullptr}, &input, &image, 1, name_pointers_.data(),
                              name_pointers_.size());
    } catch (const std::exception& e) {
      return fail("model_failed", kWho + ("says: " + gist(e.what())));
    }
    std::vector<Tensor> tensors;
    for (const Ort::Value& output : outputs_) {
      const auto info = output.GetTensorTypeAndShapeInfo();
      Tensor tensor;
      for (const std::int64_t side : info.GetShape()) {
        tensor.shape.push_back(static_cast<int>(side));
      }
      tensor.values = {output.GetTensorData<float>(), info.GetElementCount()};
      tensors.push_back(std::move(tensor));
    }
    return tensors;
  }

  std::string backend() const override { return kWho + Ort::GetVersionString(); }

 private:
  static std::string absent(const std::string& name, const std::vector<std::string>& outputs) {
    std::string there;
    for (const std::string& output : outputs) there += (there.empty() ? "" : ", ") + output;
    return kWho + ("finds no output named " + name) + " (it has " + there +
           "; perdure model import makes outputs of the heads)";
  }

  Ort::Session session_;
  Ort::MemoryInfo memory_ = Ort::MemoryInfo::CreateCpu(OrtArenaAllocator, OrtMemTypeDefault);
  std::string input_;
  std::vector<std::string> names_;
  std::vector<const char*> name_pointers_;
  std::vector<Ort::Value> outputs_;
};

}  // namespace

Result<std::unique_ptr<Network>> loadWithOnnxRuntime(const NetworkFile& file,
                                                     const std::vector<std::string>& tensors,
                                                     int threads) {
  if (!file.darknet_weights.empty()) {
    return fail("model_unreadable", kWho + std::string("does not take Darknet files"));
  }
  // Debian's library registers some operators twice and prints an error for each.
  const HeldErrors held(
      [](const std::string& line) { return !line.empty() && !line.starts_with("Schema error: "); });
  try {
    auto network = std::make_unique<OnnxRuntimeNetwork>(file.bytes, tensors, threads);
    if (const auto suits = network->suits(); !suits) return tl::unexpected(suits.error());
    return network;
  } catch (const std::exception& e) {
    return fail("model_unreadable", kWho + ("does not take it: " + gist(e.what())));
  }
}

}  // namespace perdure::inference
