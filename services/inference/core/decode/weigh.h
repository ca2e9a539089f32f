// Converts the raw values of one box to its score and evidence (eq. 6, 7; README, "Clutter").
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "services/inference/core/decode/decode.h"

namespace perdure::inference {

/// Applied probabilities are limited to [p, 1 − p], because float32 has no finer steps below 1.
inline constexpr double kLeastProbability = 1e-7;

/// Raw scores of one box; column k is at scores[k * step].
struct RawScores {
  std::optional<float> objectness;
  const float* scores;
  std::size_t step;
};

/// Fills score and activations and returns the best wanted class, if above the threshold. p_k =
/// σ(o)^a · q_k^b, q_k sigmoid or soft-max; without objectness σ(o) = 1; activations[k] =
/// logit(p_k) / T + logit(c). With a background: p = softmax(o); activations[k] = (o_k −
/// o_background) / T + logit(c). `applied` probabilities are first converted to raw values.
std::optional<std::size_t> weigh(const ModelDescription& model, const DecodeOptions& options,
                                 const RawScores& raw, Candidate& candidate);

/// Soft-max of `count` values, `step` apart.
std::vector<double> softMax(const float* values, std::size_t step, std::size_t count);

inline Box centred(double cx, double cy, double width, double height) {
  return {cx - width / 2, cy - height / 2, cx + width / 2, cy + height / 2};
}

}  // namespace perdure::inference
