// Checks that an imported network is computed correctly, because OpenCV 4.6 computes some operators
// wrongly without an error. OpenCV's outputs for a noise image are compared with those of numpy. If
// OpenCV lacks operators, ONNX Runtime's outputs of the imported and the original file are
// compared.
#pragma once

#include <filesystem>
#include <string>

namespace perdure::tools {

/// Largest difference accepted, relative to a tensor's largest value or to 1. Rounding of float32
/// causes much smaller ones.
inline constexpr double kMostDifference = 1e-3;

struct Answers {
  double difference = 0.0;  ///< the largest, relative to the tensor's largest value or to 1
  std::string tensor;       ///< tensor with this difference
  std::string by;           ///< the library that computed it: OpenCV or ONNX Runtime
};

/// Compares the outputs of `network` with those in `reference`, the folder that the import wrote.
/// Throws StartupError: 78 if the network cannot be loaded or run, 69 if a file is missing.
Answers checkAnswers(const std::filesystem::path& network, const std::filesystem::path& reference);

}  // namespace perdure::tools
