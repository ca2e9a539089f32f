// Checks that OpenCV computes an imported network correctly, because OpenCV 4.6 computes some
// operators wrongly without an error. Compares its outputs for a noise picture with those of numpy.
// If OpenCV lacks operators, it compares ONNX Runtime on the imported file with ONNX Runtime on the
// original file.
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

/// `reference`: the folder that the import wrote. Throws StartupError (78) if the network cannot be
/// loaded or run, or (69) if a file is missing.
Answers checkAnswers(const std::filesystem::path& network, const std::filesystem::path& reference);

}  // namespace perdure::tools
