// Checks OpenCV 4.6's outputs of an imported network for a noise picture against numpy's, because
// it computes some operators wrongly. Without OpenCV: ONNX Runtime on both files.
#pragma once

#include <filesystem>
#include <string>

namespace perdure::tools {

/// Relative to the largest value of a tensor, or to 1; rounding of float32 is far below it.
inline constexpr double kMostDifference = 1e-3;

struct Answers {
  double difference = 0.0;  ///< the largest, relative to the tensor's largest value or to 1
  std::string tensor;       ///< tensor with this difference
  std::string by;           ///< the computing library: OpenCV or ONNX Runtime
};

/// `reference`: of the import. Throws StartupError (78) if it fails, (69) if a file is missing.
Answers checkAnswers(const std::filesystem::path& network, const std::filesystem::path& reference);

}  // namespace perdure::tools
