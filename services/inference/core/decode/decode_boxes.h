// Decodes complete boxes with scores, one row each: exported YOLOv5 and YOLOv8, SSD, DETR.
#pragma once

#include <vector>

#include "common/base/result.h"
#include "services/inference/core/decode/decode.h"

namespace perdure::inference {

/// `tensors`: those of tensorNames(), with checked shapes. With priors and variances v: centre =
/// prior + t·v₀·size of the prior, size = size of the prior · exp(t·v₁). Fails with
/// "model_output_shape" if numbers differ.
Result<void> decodeBoxes(const ModelDescription& model, const DecodeOptions& options,
                         const std::vector<Tensor>& tensors, std::vector<Candidate>& out);

}  // namespace perdure::inference
