// Converts the raw values of one box to its score and evidence (eq. 6, 7; README, "Clutter").
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "services/inference/core/decode/decode.h"

namespace perdure::inference {

/// If a network's outputs are probabilities, they are limited to [p, 1 − p] with this p before the
/// logit, because float32 has no finer steps below 1. Their logit is then within ±16.1.
inline constexpr double kLeastProbability = 1e-7;

/// Raw scores of one box; column k is at scores[k * step].
struct RawScores {
  std::optional<float> objectness;
  const float* scores;
  std::size_t step;
};

/// Fills the candidate's score and activations, and returns the best wanted class. Returns nothing
/// if the score is below the threshold. Class k is column k, or k + 1 if the background is first.
///   p_k = σ(o)^a · q_k^b, q_k sigmoid or soft-max of the classes; without objectness σ(o) = 1
///   activations[k] = logit(p_k) / T + logit(c)
/// With a soft-max over classes and background:
///   p = softmax(o); activations[k] = (o_k − o_background) / T + logit(c), within ±kMaxLogit
/// Outputs that are probabilities (`applied`) are first converted to raw values: logit(p), or log p
/// for a soft-max.
std::optional<std::size_t> weigh(const ModelDescription& model, const DecodeOptions& options,
                                 const RawScores& raw, Candidate& candidate);

/// Returns the soft-max of `count` values that are `step` apart.
std::vector<double> softMax(const float* values, std::size_t step, std::size_t count);

inline Box centred(double cx, double cy, double width, double height) {
  return {cx - width / 2, cy - height / 2, cx + width / 2, cy + height / 2};
}

}  // namespace perdure::inference
