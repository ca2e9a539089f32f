// Whether OpenCV computes what an imported network's file says: its answers to a picture of noise
// beside those that numpy computed. Where it does not have the operators, the same of ONNX Runtime,
// beside what it says itself of the file as it was before the import. OpenCV 4.6 gets some
// operators wrong without a word.
#pragma once

#include <filesystem>
#include <string>

namespace perdure::tools {

/// Of the largest value of a tensor, or of 1: rounding of float32 stays far below.
inline constexpr double kMostDifference = 1e-3;

struct Answers {
  double difference = 0.0;  ///< the largest, in shares of the tensor's largest value or of 1
  std::string tensor;       ///< where it is
  std::string by;           ///< what computes them: OpenCV or ONNX Runtime
};

/// `reference`: the folder that the import wrote. Throws StartupError (78) where the network
/// cannot be loaded or run, 69 where a file is missing.
Answers checkAnswers(const std::filesystem::path& network, const std::filesystem::path& reference);

}  // namespace perdure::tools
