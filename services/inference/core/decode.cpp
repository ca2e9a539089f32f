#include "services/inference/core/decode.h"

#include <cmath>

#include "services/inference/core/decode_perdure.h"
#include "services/inference/core/evidence.h"

namespace perdure::inference {
namespace {

std::string textOf(const std::vector<int>& shape) {
  std::string text;
  for (const int n : shape) text += (text.empty() ? "" : "x") + std::to_string(n);
  return text.empty() ? "nothing" : text;
}

Result<void> validate(const ModelDescription& model, const std::vector<Tensor>& tensors) {
  const auto names = tensorNames(model);
  const auto shapes = expectedShapes(model);
  if (tensors.size() != names.size()) return fail("model_output_shape", "tensors are missing");
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (tensors[i].shape != shapes[i]) {
      return fail("model_output_shape", names[i] + " is " + textOf(tensors[i].shape) + ", not " +
                                            textOf(shapes[i]) + " as model.json says");
    }
    for (const float value : tensors[i].values) {
      if (!std::isfinite(value)) return fail("model_output_not_finite", names[i]);
    }
  }
  return {};
}

/// The raw values of one anchor: class k is at classes[k * step].
struct Head {
  double objectness;
  const float* classes;
  std::size_t step;
};

double logSumExp(const Head& head, std::size_t count) {
  double highest = head.classes[0];
  for (std::size_t k = 1; k < count; ++k) {
    highest = std::max(highest, double{head.classes[k * head.step]});
  }
  double sum = 0;
  for (std::size_t k = 0; k < count; ++k) sum += std::exp(head.classes[k * head.step] - highest);
  return highest + std::log(sum);
}

/// Fills score and activations; false where the box is below the threshold.
bool weigh(const ModelDescription& model, const DecodeOptions& options, const Head& head,
           Candidate& candidate) {
  const double log_threshold = std::log(options.score_threshold);
  const double log_objectness = logSigmoid(head.objectness);
  if (model.objectness_exponent * log_objectness < log_threshold) return false;
  const double normaliser = model.class_softmax ? logSumExp(head, model.classes.size()) : 0.0;
  std::vector<double> scores;
  scores.reserve(options.wanted.size());
  double best = -1e300;
  for (const std::size_t k : options.wanted) {
    const double raw = head.classes[k * head.step];
    const double log_class = model.class_softmax ? raw - normaliser : logSigmoid(raw);
    scores.push_back(logScore(model, log_objectness, log_class));
    best = std::max(best, scores.back());
  }
  if (best < log_threshold) return false;
  candidate.score = std::exp(best);
  candidate.activations.assign(1, 0.0F);
  for (const double score : scores) {
    candidate.activations.push_back(activation(model.calibration, score));
  }
  return true;
}

Box centred(double cx, double cy, double width, double height) {
  return {cx - width / 2, cy - height / 2, cx + width / 2, cy + height / 2};
}

/// YOLOX: centre (gx + x)·s, size exp(w)·s. FastestDet: centre (gx + tanh x)·s, size σ(w)·input.
Box boxOf(const ModelDescription& model, const Level& level, int gx, int gy, const float* raw,
          std::size_t step) {
  const double x = raw[0], y = raw[step], w = raw[2 * step], h = raw[3 * step];
  const double s = level.stride;
  if (model.family == Family::kYolox) {
    return centred((gx + x) * s, (gy + y) * s, std::exp(w) * s, std::exp(h) * s);
  }
  return centred((gx + std::tanh(x)) * s, (gy + std::tanh(y)) * s, sigmoid(w) * model.input.width,
                 sigmoid(h) * model.input.height);
}

/// YOLOX and FastestDet: planes box (4), objectness (1), classes (K) of H×W cells.
void decodePlanes(const ModelDescription& model, const DecodeOptions& options, const Level& level,
                  const Tensor* tensors, std::vector<Candidate>& out) {
  const int columns = model.input.width / level.stride, rows = model.input.height / level.stride;
  const auto cells = static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
  for (std::size_t i = 0; i < cells; ++i) {
    Candidate candidate;
    const Head head{tensors[1].values[i], tensors[2].values.data() + i, cells};
    if (!weigh(model, options, head, candidate)) continue;
    const int gx = static_cast<int>(i) % columns, gy = static_cast<int>(i) / columns;
    candidate.box = boxOf(model, level, gx, gy, tensors[0].values.data() + i, cells);
    out.push_back(std::move(candidate));
  }
}

/// YOLO-Fastest (YOLOv3 heads): rows of A·(x, y, w, h, objectness, K classes) for each cell;
/// centre (gx + σ(x))·s, size anchor·exp(w).
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

}  // namespace

std::pair<int, int> cellsOf(const ModelDescription& model, const Level& level) {
  const int beyond = model.family == Family::kPerdure ? level.stride - 1 : 0;
  return {(model.input.width + beyond) / level.stride,
          (model.input.height + beyond) / level.stride};
}

std::vector<std::vector<int>> expectedShapes(const ModelDescription& model) {
  std::vector<std::vector<int>> shapes;
  const int classes = static_cast<int>(model.classes.size());
  for (const Level& level : model.levels) {
    const auto [columns, rows] = cellsOf(model, level);
    if (model.family == Family::kPerdure) {
      shapes.push_back({1, 4, rows, columns});
      shapes.push_back({1, 1 + classes, rows, columns});
      if (model.azimuth.bins > 0) shapes.push_back({1, 2 * model.azimuth.bins, rows, columns});
      if (model.spread_scale > 0) shapes.push_back({1, 4, rows, columns});
    } else if (model.family == Family::kYoloFastest) {
      shapes.push_back({1, rows, columns, static_cast<int>(level.anchors.size()) * (5 + classes)});
    } else {
      for (const int channels : {4, 1, classes}) shapes.push_back({1, channels, rows, columns});
    }
  }
  return shapes;
}

Result<std::vector<Candidate>> decode(const ModelDescription& model, const DecodeOptions& options,
                                      const std::vector<Tensor>& tensors) {
  if (const auto valid = validate(model, tensors); !valid) return tl::unexpected(valid.error());
  std::vector<Candidate> candidates;
  const std::size_t per_level = tensors.size() / model.levels.size();
  for (std::size_t i = 0; i < model.levels.size(); ++i) {
    const Tensor* first = &tensors[i * per_level];
    if (model.family == Family::kYoloFastest) {
      decodeAnchors(model, options, model.levels[i], *first, candidates);
    } else if (model.family == Family::kPerdure) {
      decodePerdure(model, options, model.levels[i], {first, per_level}, candidates);
    } else {
      decodePlanes(model, options, model.levels[i], first, candidates);
    }
  }
  for (const Candidate& c : candidates) {
    if (!std::isfinite(c.box.area())) return fail("model_output_not_finite", "a box is too large");
  }
  return candidates;
}

}  // namespace perdure::inference
