#include "services/inference/core/decode/decode_families.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

#include "services/inference/core/decode/evidence.h"
#include "services/inference/core/decode/weigh.h"

namespace perdure::inference {
namespace {

/// Values of one cell: channel i is at data[i * step].
struct Cell {
  const float* data;
  std::size_t step;
  double operator[](std::size_t channel) const { return data[channel * step]; }
};

double softPlus(double x) { return -logSigmoid(-x); }

Box boxOf(const Cell& raw, double x, double y, double stride, double reach) {
  const auto distance = [&](std::size_t side) { return stride * (softPlus(raw[side]) - reach); };
  return {x - distance(0), y - distance(1), x + distance(2), y + distance(3)};
}

void readAzimuth(const Azimuth& azimuth, const Cell& raw, Candidate& candidate) {
  const auto bins = static_cast<std::size_t>(azimuth.bins);
  const auto p = softMax(raw.data, raw.step, bins);
  const double half = std::numbers::pi / azimuth.bins;
  std::complex<double> doubled = 0;
  const auto angle = [&](std::size_t i) {
    return half * (2.0 * static_cast<double>(i) + raw[bins + i]);
  };
  for (std::size_t i = 0; i < bins; ++i) doubled += std::polar(p[i], 2 * angle(i));
  const auto best = static_cast<std::size_t>(std::max_element(p.begin(), p.end()) - p.begin());
  candidate.azimuth = std::remainder(angle(best), 2 * std::numbers::pi);
  const double spread = std::sqrt(-2 * std::log(std::clamp(std::abs(doubled), 1e-6, 1.0))) / 2;
  candidate.azimuth_sigma = std::hypot(azimuth.sigma, spread);
}

bool reportsAzimuth(const ModelDescription& model, std::size_t k) {
  const auto& names = model.azimuth.classes;
  return model.azimuth.bins > 0 &&
         std::find(names.begin(), names.end(), model.classes[k]) != names.end();
}

}  // namespace

void decodePerdure(const ModelDescription& model, const DecodeOptions& options, const Level& level,
                   std::span<const Tensor> tensors, std::vector<Candidate>& out) {
  const auto [columns, rows] = cellsOf(model, level);
  const auto cells = static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
  for (std::size_t i = 0; i < cells; ++i) {
    Candidate candidate;
    const auto best = weigh(model, options, {{}, tensors[1].values.data() + i, cells}, candidate);
    if (!best) continue;
    const double x = (static_cast<int>(i) % columns + 0.5) * level.stride;
    const double y = (static_cast<int>(i) / columns + 0.5) * level.stride;
    candidate.box = boxOf({tensors[0].values.data() + i, cells}, x, y, level.stride, model.reach);
    if (model.spread_scale > 0) {
      const Cell raw{tensors.back().values.data() + i, cells};
      for (std::size_t side = 0; side < 4; ++side) {
        candidate.side_sigma[side] = model.spread_scale * level.stride * softPlus(raw[side]);
      }
    }
    if (reportsAzimuth(model, *best)) {
      readAzimuth(model.azimuth, {tensors[2].values.data() + i, cells}, candidate);
    }
    out.push_back(std::move(candidate));
  }
}

}  // namespace perdure::inference
