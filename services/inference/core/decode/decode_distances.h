// Decodes raw heads that describe the distances of the sides as distributions (Generalized Focal
// Loss, NeurIPS 2020): YOLOv8, YOLO11 and NanoDet. They have no objectness.
#pragma once

#include <vector>

#include "services/inference/core/decode/decode.h"

namespace perdure::inference {

/// `tensors`: those of tensorNames(), with checked shapes. The distance of each side is the mean of
/// 0 … bins − 1 under the soft-max of its bins:
///   sides: (g + cell_offset)·s ∓ s·E[distance], in the order left, top, right, bottom
void decodeDistances(const ModelDescription& model, const DecodeOptions& options,
                     const std::vector<Tensor>& tensors, std::vector<Candidate>& out);

}  // namespace perdure::inference
