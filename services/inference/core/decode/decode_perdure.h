// The heads of the project's own network (tools/train): a soft-max over background and K classes,
// distances from the cell to the box's sides, azimuth as bins and residuals.
#pragma once

#include <span>
#include <vector>

#include "services/inference/core/decode/decode.h"

namespace perdure::inference {

/// `tensors`: box, logits and, where the model has them, azimuth and spread of one level; shapes
/// are checked.
///   p = softmax(o_0 … o_K), 0 the background; score: the largest p_k of the wanted classes
///   activations[k] = (o_k − o_0) / T + logit(c), within ±kMaxLogit
///   sides: centre of the cell ∓ s · (softplus(left, top, right, bottom) − reach)
///   side_sigma = scale · s · softplus(spread)
///   azimuth: centre of the likeliest bin + residual · half a bin
///   azimuth_sigma² = sigma² + the circular variance of all bins' answers modulo half a turn:
///   front and back are often mistaken, which is no Gaussian error
void decodePerdure(const ModelDescription& model, const DecodeOptions& options, const Level& level,
                   std::span<const Tensor> tensors, std::vector<Candidate>& out);

}  // namespace perdure::inference
