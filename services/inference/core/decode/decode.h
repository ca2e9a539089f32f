// Decodes the raw tensors of the heads to boxes with evidence. Each family has one rule (paper, eq.
// 6, 7).
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "common/base/result.h"
#include "common/types/detections.h"
#include "services/inference/core/description.h"
#include "services/inference/core/network/tensors.h"

namespace perdure::inference {

struct Candidate {
  Box box;             ///< pixels of the network's input
  double score = 0.0;  ///< the highest class score, before calibration
  std::vector<float> activations;
  std::optional<double> azimuth = {};  ///< alpha (KITTI), radians
  double azimuth_sigma = 0.35;         ///< radians
  std::array<double, 4> side_sigma{};  ///< pixels of the input; 0 = unknown
};

struct DecodeOptions {
  double score_threshold = 0.05;    ///< least score of a box in its best wanted class
  std::vector<std::size_t> wanted;  ///< indices of the model's classes to report, in order
};

/// Returns the boxes whose score reaches the threshold. Fails with "model_output_shape" or
/// "model_output_not_finite".
Result<std::vector<Candidate>> decode(const ModelDescription& model, const DecodeOptions& options,
                                      const std::vector<Tensor>& tensors);

}  // namespace perdure::inference
