#include "tools/model/check.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <vector>

#include "common/base/errors.h"
#include "services/inference/core/network/network.h"
#include "services/inference/model_file.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;

std::vector<float> floatsIn(const fs::path& file, std::size_t count) {
  std::vector<float> values(count);
  std::ifstream in(file, std::ios::binary);
  in.read(reinterpret_cast<char*>(values.data()),
          static_cast<std::streamsize>(count * sizeof(float)));
  if (!in || in.peek() != std::ifstream::traits_type::eof()) {
    throw StartupError(ExitCode::kConfiguration,
                       file.string() +
                           " is missing or not of the tensor's size: the network gives a " +
                           "tensor of " + std::to_string(count) + " values");
  }
  return values;
}

StartupError notLoaded(const fs::path& network, const Reason& reason) {
  return {ExitCode::kConfiguration, network.string() + " cannot be used: " + reason.detail +
                                        "; export with an older opset (11 to 13), or a smaller "
                                        "or plainer network of the family"};
}

/// Returns the largest difference; NaN counts as infinite.
double differenceOf(const inference::Tensor& tensor, const std::vector<float>& expected) {
  double largest = 1.0, difference = 0.0;
  for (std::size_t i = 0; i < expected.size(); ++i) {
    largest = std::max(largest, std::abs(double{expected[i]}));
    const double error = std::abs(double{expected[i]} - double{tensor.values[i]});
    difference = std::isnan(error) ? INFINITY : std::max(difference, error);
  }
  return difference / largest;
}

}  // namespace

Answers checkAnswers(const fs::path& path, const fs::path& reference) {
  const auto file = inference::readModelFile(path.string(), path.string() + ".model.json", {});
  const auto names = inference::tensorNames(file.description);
  const bool other = file.description.for_onnx_runtime;
  auto network = inference::loadNetwork({file.network, "", other}, names);
  if (!network) throw notLoaded(path, network.error());
  const auto& input = file.description.input;
  const int sizes[] = {1, 3, input.height, input.width};
  const auto noise =
      floatsIn(reference / "input.f32", static_cast<std::size_t>(3 * input.height * input.width));
  const cv::Mat blob(4, sizes, CV_32F, const_cast<float*>(noise.data()));
  const auto tensors = (*network)->forward(blob);
  if (!tensors) throw notLoaded(path, tensors.error());
  Answers answers{0.0, "", other ? "ONNX Runtime" : "OpenCV"};
  for (std::size_t i = 0; i < names.size(); ++i) {
    const auto& tensor = (*tensors)[i];
    const double difference =
        differenceOf(tensor, floatsIn(reference / (names[i] + ".f32"), tensor.values.size()));
    if (difference >= answers.difference) answers = {difference, names[i], answers.by};
  }
  return answers;
}

}  // namespace perdure::tools
