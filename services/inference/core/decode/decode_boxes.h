// Whole boxes with scores, one row each: YOLOv5 and v8 as they are exported, SSD, DETR.
#pragma once

#include <vector>

#include "common/base/result.h"
#include "services/inference/core/decode/decode.h"

namespace perdure::inference {

/// `tensors`: those of tensorNames(), shapes checked. The four numbers of a box are read as
/// `box_form` says; a share is one of the input's width or height. With priors and variances v:
///   centre = prior + t·v₀·size of the prior, size = size of the prior · exp(t·v₁)
/// Reasons: "model_output_shape" where boxes, scores and priors are not as many.
Result<void> decodeBoxes(const ModelDescription& model, const DecodeOptions& options,
                         const std::vector<Tensor>& tensors, std::vector<Candidate>& out);

}  // namespace perdure::inference
