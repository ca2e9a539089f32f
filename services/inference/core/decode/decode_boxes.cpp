#include <cmath>
#include <string>

#include "services/inference/core/decode/decode_families.h"
#include "services/inference/core/decode/weigh.h"

namespace perdure::inference {
namespace {

/// Rows of a tensor. Column c of row i is at data[c * column + i * row].
struct Rows {
  const float* data;
  std::size_t column, row;
  const float* at(std::size_t i) const { return data + i * row; }
};

struct Views {
  std::size_t count;
  Rows boxes, scores;
  bool objectness;  ///< objectness is in the column before the scores
};

Views viewsOf(const ModelDescription& model, const std::vector<Tensor>& tensors) {
  const bool planes = model.family == Family::kYolov8;
  const Tensor& boxes = tensors.front();
  const auto count = static_cast<std::size_t>(boxes.shape[planes ? 2 : 1]);
  const auto rowsOf = [&](const Tensor& tensor) {
    const auto width = static_cast<std::size_t>(tensor.shape[planes ? 1 : 2]);
    return Rows{tensor.values.data(), planes ? count : 1, planes ? 1 : width};
  };
  Views views{count, rowsOf(boxes), rowsOf(tensors.back()), model.family == Family::kYolov5};
  if (tensors.size() == 1) views.scores.data += (views.objectness ? 5 : 4) * views.scores.column;
  return views;
}

Box offsetFrom(const std::array<double, 4>& prior, const std::array<double, 2>& variances,
               const std::array<double, 4>& t) {
  return centred(
      prior[0] + t[0] * variances[0] * prior[2], prior[1] + t[1] * variances[0] * prior[3],
      prior[2] * std::exp(t[2] * variances[1]), prior[3] * std::exp(t[3] * variances[1]));
}

Box boxOf(const ModelDescription& model, const Rows& rows, std::size_t i) {
  const BoxForm& form = model.box_form;
  std::array<double, 4> t;
  for (std::size_t c = 0; c < 4; ++c) t[form.y_first ? c ^ 1U : c] = rows.at(i)[c * rows.column];
  Box box{t[0], t[1], t[2], t[3]};
  if (form.kind == BoxForm::Kind::kCentre) box = centred(t[0], t[1], t[2], t[3]);
  if (form.kind == BoxForm::Kind::kOffsets) box = offsetFrom(form.priors[i], form.variances, t);
  const double x = form.shares ? model.input.width : 1, y = form.shares ? model.input.height : 1;
  return {box.x1 * x, box.y1 * y, box.x2 * x, box.y2 * y};
}

Result<void> checkCounts(const ModelDescription& model, const std::vector<Tensor>& tensors,
                         std::size_t count) {
  const std::size_t length = model.family == Family::kYolov8 ? 2 : 1;
  if (static_cast<std::size_t>(tensors.back().shape[length]) != count) {
    return fail("model_output_shape", "boxes and scores are not as many");
  }
  const auto& form = model.box_form;
  if (form.kind == BoxForm::Kind::kOffsets && form.priors.size() != count) {
    return fail("model_output_shape", "there are " + std::to_string(count) + " boxes and " +
                                          std::to_string(form.priors.size()) + " priors");
  }
  return {};
}

}  // namespace

Result<void> decodeBoxes(const ModelDescription& model, const DecodeOptions& options,
                         const std::vector<Tensor>& tensors, std::vector<Candidate>& out) {
  const Views views = viewsOf(model, tensors);
  if (const auto same = checkCounts(model, tensors, views.count); !same) return same;
  for (std::size_t i = 0; i < views.count; ++i) {
    RawScores raw{{}, views.scores.at(i), views.scores.column};
    if (views.objectness) raw.objectness = views.boxes.at(i)[4 * views.boxes.column];
    Candidate candidate;
    if (!weigh(model, options, raw, candidate)) continue;
    candidate.box = boxOf(model, views.boxes, i);
    out.push_back(std::move(candidate));
  }
  return {};
}

}  // namespace perdure::inference
