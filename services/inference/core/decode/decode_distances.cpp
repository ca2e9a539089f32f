#include <cmath>

#include "services/inference/core/decode/decode_families.h"
#include "services/inference/core/decode/weigh.h"

namespace perdure::inference {
namespace {

/// Values of one level: channel c of cell i is at [c * channel_step + i * cell_step].
struct LevelView {
  const float *sides, *classes;
  std::size_t channel_step, cell_step;
};

std::size_t cellCount(const ModelDescription& model, const Level& level) {
  const auto [columns, rows] = cellsOf(model, level);
  return static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
}

/// Returns the view of sides and classes in one tensor. YOLOv8 has the sides first, NanoDet the
/// classes.
LevelView together(const ModelDescription& model, const float* data, std::size_t channel_step,
                   std::size_t cell_step) {
  const std::size_t sides = 4 * static_cast<std::size_t>(model.bins);
  if (model.family == Family::kNanoDet) {
    return {data + model.classes.size() * channel_step, data, channel_step, cell_step};
  }
  return {data, data + sides * channel_step, channel_step, cell_step};
}

std::vector<LevelView> levelViewsOf(const ModelDescription& model,
                                    const std::vector<Tensor>& tensors) {
  const std::size_t row = model.classes.size() + 4 * static_cast<std::size_t>(model.bins);
  std::vector<LevelView> views;
  std::size_t next = 0, offset = 0;
  for (const Level& level : model.levels) {
    const std::size_t cells = cellCount(model, level);
    if (model.outputs.any()) {
      views.push_back(together(model, tensors[0].values.data() + offset, 1, row));
      offset += cells * row;
    } else if (!level.tensor.empty()) {
      views.push_back(together(model, tensors[next++].values.data(), cells, 1));
    } else {
      views.push_back({tensors[next].values.data(), tensors[next + 1].values.data(), cells, 1});
      next += 2;
    }
  }
  return views;
}

/// Returns the mean of a distance's bins, in cells.
double meanDistance(const float* bins, std::size_t step, int count) {
  const auto p = softMax(bins, step, static_cast<std::size_t>(count));
  double mean = 0;
  for (std::size_t i = 0; i < p.size(); ++i) mean += p[i] * static_cast<double>(i);
  return mean;
}

Box boxOf(const ModelDescription& model, double x, double y, double s, const LevelView& view,
          std::size_t cell) {
  const auto distance = [&](std::size_t side) {
    const std::size_t first = side * static_cast<std::size_t>(model.bins);
    const float* raw = view.sides + first * view.channel_step + cell * view.cell_step;
    if (model.bins > 1) return s * meanDistance(raw, view.channel_step, model.bins);
    return s * (model.exponents ? std::exp(double{*raw}) : double{*raw});
  };
  return {x - distance(0), y - distance(1), x + distance(2), y + distance(3)};
}

}  // namespace

void decodeDistances(const ModelDescription& model, const DecodeOptions& options,
                     const std::vector<Tensor>& tensors, std::vector<Candidate>& out) {
  const auto views = levelViewsOf(model, tensors);
  for (std::size_t l = 0; l < model.levels.size(); ++l) {
    const Level& level = model.levels[l];
    const LevelView& view = views[l];
    const int columns = cellsOf(model, level).first;
    for (std::size_t i = 0; i < cellCount(model, level); ++i) {
      Candidate candidate;
      const RawScores raw{{}, view.classes + i * view.cell_step, view.channel_step};
      if (!weigh(model, options, raw, candidate)) continue;
      const double s = level.stride;
      const double x = (static_cast<int>(i) % columns + model.cell_offset) * s;
      const double y = (static_cast<int>(i) / columns + model.cell_offset) * s;
      candidate.box = boxOf(model, x, y, s, view, i);
      const Box& box = candidate.box;
      if (model.bins == 1 && (box.x2 <= box.x1 || box.y2 <= box.y1))
        continue;  // negative distances give no box
      out.push_back(std::move(candidate));
    }
  }
}

}  // namespace perdure::inference
