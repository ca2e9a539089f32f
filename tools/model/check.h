// Whether OpenCV computes what an imported network's file says: its answers to a picture of noise
// beside those that numpy computed. OpenCV 4.6 gets some operators wrong without a word.
#pragma once

#include <filesystem>
#include <string>

namespace perdure::tools {

/// Of the largest value of a tensor, or of 1: rounding of float32 stays far below.
inline constexpr double kMostDifference = 1e-3;

struct Answers {
  double difference = 0.0;  ///< the largest, in shares of the tensor's largest value or of 1
  std::string tensor;       ///< where it is
};

/// `reference`: the folder that the import wrote. Throws StartupError (78) where OpenCV cannot load
/// or run the network, 69 where a file is missing.
Answers checkAnswers(const std::filesystem::path& network, const std::filesystem::path& reference);

}  // namespace perdure::tools
