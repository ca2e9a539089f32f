// The decode rules of the families of networks.
#pragma once

#include <span>
#include <vector>

#include "common/base/result.h"
#include "services/inference/core/decode/decode.h"

namespace perdure::inference {

/// Decodes the project's own network (tools/train). `tensors` are box and logits of one level, and
/// azimuth and spread if the model has them. Their shapes must have been validated.
///   p = softmax(o_0 … o_K), 0 is the background; score: the largest p_k of the wanted classes
///   activations[k] = (o_k − o_0) / T + logit(c), within ±kMaxLogit
///   sides: centre of the cell ∓ s · (softplus(left, top, right, bottom) − reach)
///   side_sigma = scale · s · softplus(spread)
///   azimuth: centre of the most probable bin + residual · half a bin
///   azimuth_sigma² = sigma² + the circular variance of all bins' angles modulo half a turn.
/// Networks often confuse front and back, which is not a Gaussian error.
void decodePerdure(const ModelDescription& model, const DecodeOptions& options, const Level& level,
                   std::span<const Tensor> tensors, std::vector<Candidate>& out);

/// YOLOv5, YOLOv7 and YOLO-FastestV2. `tensor`: (1,A·(5+K),H,W) or (1,A,H,W,5+K) of one level. Each
/// anchor has x, y, w, h, objectness and K classes: centre (g − ½ + 2σ(t))·s, size anchor·(2σ(t))²
void decodeYolov5(const ModelDescription& model, const DecodeOptions& options, const Level& level,
                  const Tensor& tensor, std::vector<Candidate>& out);
/// Returns the box of anchor `a` in cell (gx, gy). `raw` points to x, y, w and h, which are `step`
/// apart.
Box anchoredBox(const Level& level, std::size_t a, int gx, int gy, const float* raw,
                std::size_t step);

/// Decodes complete boxes with scores, one row each: exported YOLOv5 and YOLOv8, SSD, and DETR.
/// With priors and variances v: centre = prior + t·v₀·size of the prior, size = size of the prior ·
/// exp(t·v₁). Fails with "model_output_shape" if the numbers of boxes, scores and priors differ.
Result<void> decodeBoxes(const ModelDescription& model, const DecodeOptions& options,
                         const std::vector<Tensor>& tensors, std::vector<Candidate>& out);

/// Decodes distributions of the sides' distances (Generalized Focal Loss, NeurIPS 2020): YOLOv8,
/// YOLO11, NanoDet. The distance of each side is the mean of 0 … bins − 1 under the soft-max of its
/// bins:
///   sides: (g + cell_offset)·s ∓ s·E[distance], in the order left, top, right, bottom
void decodeDistances(const ModelDescription& model, const DecodeOptions& options,
                     const std::vector<Tensor>& tensors, std::vector<Candidate>& out);

}  // namespace perdure::inference
