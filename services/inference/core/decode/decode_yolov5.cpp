#include "services/inference/core/decode/decode_families.h"
#include "services/inference/core/decode/evidence.h"
#include "services/inference/core/decode/weigh.h"

namespace perdure::inference {
namespace {

double square(double x) { return x * x; }

}  // namespace

Box anchoredBox(const Level& level, std::size_t a, int gx, int gy, const float* raw,
                std::size_t step) {
  const double s = level.stride;
  return centred((gx - 0.5 + 2 * sigmoid(raw[0])) * s, (gy - 0.5 + 2 * sigmoid(raw[step])) * s,
                 level.anchors[a].first * square(2 * sigmoid(raw[2 * step])),
                 level.anchors[a].second * square(2 * sigmoid(raw[3 * step])));
}

void decodeYolov5(const ModelDescription& model, const DecodeOptions& options, const Level& level,
                  const Tensor& tensor, std::vector<Candidate>& out) {
  const auto [columns, rows] = cellsOf(model, level);
  const auto cells = static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
  const std::size_t row = 5 + model.classes.size();
  const bool planes = tensor.shape.size() == 4;
  const std::size_t step = planes ? cells : 1, next = planes ? 1 : row;
  for (std::size_t a = 0; a < level.anchors.size(); ++a) {
    for (std::size_t i = 0; i < cells; ++i) {
      const float* raw = tensor.values.data() + a * row * cells + i * next;
      Candidate candidate;
      if (!weigh(model, options, {raw[4 * step], raw + 5 * step, step}, candidate)) continue;
      const int gx = static_cast<int>(i) % columns, gy = static_cast<int>(i) / columns;
      candidate.box = anchoredBox(level, a, gx, gy, raw, step);
      out.push_back(std::move(candidate));
    }
  }
}

}  // namespace perdure::inference
