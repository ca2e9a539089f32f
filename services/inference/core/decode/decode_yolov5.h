// Decodes raw heads of YOLOv5, YOLOv7 and YOLO-FastestV2: anchors, boxes through a sigmoid.
#pragma once

#include <vector>

#include "services/inference/core/decode/decode.h"

namespace perdure::inference {

/// `tensor`: (1,A·(5+K),H,W) or (1,A,H,W,5+K) of one level, with checked shape. Each anchor has x,
/// y, w, h, objectness and K classes:
///   centre (g − ½ + 2σ(t))·s, size anchor·(2σ(t))²
void decodeYolov5(const ModelDescription& model, const DecodeOptions& options, const Level& level,
                  const Tensor& tensor, std::vector<Candidate>& out);

/// `tensors`: (1,4·A,H,W), (1,A,H,W) and (1,K,H,W) of one level, with checked shapes. They are the
/// boxes as above, the objectness, and the classes of a cell, which all its anchors share.
void decodeYoloFastestV2(const ModelDescription& model, const DecodeOptions& options,
                         const Level& level, const Tensor* tensors, std::vector<Candidate>& out);

}  // namespace perdure::inference
