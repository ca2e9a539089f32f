// Decodes the heads of the project's own network (tools/train): a soft-max over background and K
// classes, distances from the cell to the box's sides, and azimuth as bins and residuals.
#pragma once

#include <span>
#include <vector>

#include "services/inference/core/decode/decode.h"

namespace perdure::inference {

/// `tensors`: box and logits of one level, and azimuth and spread if the model has them. Shapes are
/// checked.
///   p = softmax(o_0 … o_K), 0 is the background; score: the largest p_k of the wanted classes
///   activations[k] = (o_k − o_0) / T + logit(c), within ±kMaxLogit
///   sides: centre of the cell ∓ s · (softplus(left, top, right, bottom) − reach)
///   side_sigma = scale · s · softplus(spread)
///   azimuth: centre of the most probable bin + residual · half a bin
///   azimuth_sigma² = sigma² + the circular variance of all bins' angles modulo half a turn.
/// Networks often confuse front and back, which is not a Gaussian error.
void decodePerdure(const ModelDescription& model, const DecodeOptions& options, const Level& level,
                   std::span<const Tensor> tensors, std::vector<Candidate>& out);

}  // namespace perdure::inference
