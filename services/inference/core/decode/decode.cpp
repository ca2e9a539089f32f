#include "services/inference/core/decode/decode.h"

#include <cmath>

#include "services/inference/core/decode/decode_families.h"
#include "services/inference/core/decode/evidence.h"
#include "services/inference/core/decode/weigh.h"

namespace perdure::inference {
namespace {

/// Decodes the box of cell (gx, gy) with stride s. YOLOX: centre (gx + x)·s, size exp(w)·s.
/// FastestDet: centre (gx + tanh x)·s, size σ(w)·input. YOLO-FastestV2: as YOLOv5, with anchor `a`.
Box boxOf(const ModelDescription& model, const Level& level, std::size_t a, int gx, int gy,
          const float* raw, std::size_t step) {
  if (model.family == Family::kYoloFastestV2) return anchoredBox(level, a, gx, gy, raw, step);
  const double x = raw[0], y = raw[step], w = raw[2 * step], h = raw[3 * step];
  const double s = level.stride;
  if (model.family == Family::kYolox) {
    return centred((gx + x) * s, (gy + y) * s, std::exp(w) * s, std::exp(h) * s);
  }
  return centred((gx + std::tanh(x)) * s, (gy + std::tanh(y)) * s, sigmoid(w) * model.input.width,
                 sigmoid(h) * model.input.height);
}

/// Decodes YOLOX, FastestDet and YOLO-FastestV2: planes of H×W cells for box (4·A), objectness (A)
/// and classes (K).
void decodePlanes(const ModelDescription& model, const DecodeOptions& options, const Level& level,
                  const Tensor* tensors, std::vector<Candidate>& out) {
  const int columns = model.input.width / level.stride, rows = model.input.height / level.stride;
  const auto cells = static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
  const std::size_t anchors = model.family == Family::kYoloFastestV2 ? level.anchors.size() : 1;
  for (std::size_t a = 0; a < anchors; ++a) {
    for (std::size_t i = 0; i < cells; ++i) {
      Candidate candidate;
      const RawScores raw{tensors[1].values[a * cells + i], tensors[2].values.data() + i, cells};
      if (!weigh(model, options, raw, candidate)) continue;
      const int gx = static_cast<int>(i) % columns, gy = static_cast<int>(i) / columns;
      const float* box = tensors[0].values.data() + 4 * a * cells + i;
      candidate.box = boxOf(model, level, a, gx, gy, box, cells);
      out.push_back(std::move(candidate));
    }
  }
}

/// Decodes YOLO-Fastest (YOLOv3 heads): each cell has a row of A·(x, y, w, h, objectness, K
/// classes). Centre (gx + σ(x))·s, size anchor·exp(w).
void decodeAnchors(const ModelDescription& model, const DecodeOptions& options, const Level& level,
                   const Tensor& tensor, std::vector<Candidate>& out) {
  const int columns = model.input.width / level.stride, rows = model.input.height / level.stride;
  const std::size_t stride = 5 + model.classes.size();
  const float* raw = tensor.values.data();
  for (int cell = 0; cell < columns * rows; ++cell) {
    for (const auto& [width, height] : level.anchors) {
      Candidate candidate;
      if (weigh(model, options, {raw[4], raw + 5, 1}, candidate)) {
        candidate.box = centred((cell % columns + sigmoid(raw[0])) * level.stride,
                                (cell / columns + sigmoid(raw[1])) * level.stride,
                                width * std::exp(raw[2]), height * std::exp(raw[3]));
        out.push_back(std::move(candidate));
      }
      raw += stride;
    }
  }
}

void decodeLevels(const ModelDescription& model, const DecodeOptions& options,
                  const std::vector<Tensor>& tensors, std::vector<Candidate>& out) {
  const std::size_t per_level = tensors.size() / model.levels.size();
  for (std::size_t i = 0; i < model.levels.size(); ++i) {
    const Level& level = model.levels[i];
    const Tensor* first = &tensors[i * per_level];
    if (model.family == Family::kYoloFastest) {
      decodeAnchors(model, options, level, *first, out);
    } else if (model.family == Family::kYolov5) {
      decodeYolov5(model, options, level, *first, out);
    } else if (model.family == Family::kPerdure) {
      decodePerdure(model, options, level, {first, per_level}, out);
    } else {
      decodePlanes(model, options, level, first, out);
    }
  }
}

}  // namespace

Result<std::vector<Candidate>> decode(const ModelDescription& model, const DecodeOptions& options,
                                      const std::vector<Tensor>& tensors) {
  if (const auto valid = validate(model, tensors); !valid) return tl::unexpected(valid.error());
  std::vector<Candidate> candidates;
  const bool distances =
      model.family == Family::kNanoDet || (model.family == Family::kYolov8 && !model.outputs.any());
  if (distances) {
    decodeDistances(model, options, tensors, candidates);
  } else if (model.outputs.any()) {
    const auto done = decodeBoxes(model, options, tensors, candidates);
    if (!done) return tl::unexpected(done.error());
  } else {
    decodeLevels(model, options, tensors, candidates);
  }
  for (const Candidate& c : candidates) {
    if (!std::isfinite(c.box.area())) return fail("model_output_not_finite", "a box is too large");
  }
  return candidates;
}

}  // namespace perdure::inference
