// Decodes raw heads of YOLOv5, YOLOv7 and YOLO-FastestV2: anchors, boxes through a sigmoid.
#pragma once

#include <vector>

#include "services/inference/core/decode/decode.h"

namespace perdure::inference {

/// `tensor`: (1,A·(5+K),H,W) or (1,A,H,W,5+K) of one level. Each anchor has x, y, w, h, objectness
/// and K classes: centre (g − ½ + 2σ(t))·s, size anchor·(2σ(t))²
void decodeYolov5(const ModelDescription& model, const DecodeOptions& options, const Level& level,
                  const Tensor& tensor, std::vector<Candidate>& out);
/// Box of anchor `a` in cell (gx, gy): `raw` holds x, y, w and h, `step` apart.
Box anchoredBox(const Level& level, std::size_t a, int gx, int gy, const float* raw,
                std::size_t step);

}  // namespace perdure::inference
