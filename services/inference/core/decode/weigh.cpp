#include "services/inference/core/decode/weigh.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "services/inference/core/decode/evidence.h"

namespace perdure::inference {
namespace {

class Columns {
 public:
  Columns(const ModelDescription& model, const RawScores& raw)
      : raw_(raw),
        first_(model.background == Background::kFirst ? 1 : 0),
        applied_(model.applied),
        softmax_(model.class_softmax) {}

  double ofClass(std::size_t k) const { return at(first_ + k); }
  double at(std::size_t column) const {
    const double value = raw_.scores[column * raw_.step];
    if (!applied_) return value;
    if (softmax_) return std::log(std::max(value, kLeastProbability));
    return logit(std::clamp(value, kLeastProbability, 1 - kLeastProbability));
  }

 private:
  const RawScores& raw_;
  std::size_t first_;
  bool applied_, softmax_;
};

std::optional<std::size_t> bestOf(const DecodeOptions& options, const Columns& columns) {
  std::optional<std::size_t> best;
  for (const std::size_t k : options.wanted) {
    if (!best || columns.ofClass(k) > columns.ofClass(*best)) best = k;
  }
  return best;
}

double logSumExp(const Columns& columns, std::size_t count) {
  double highest = columns.ofClass(0);
  for (std::size_t k = 1; k < count; ++k) highest = std::max(highest, columns.ofClass(k));
  double sum = 0;
  for (std::size_t k = 0; k < count; ++k) sum += std::exp(columns.ofClass(k) - highest);
  return highest + std::log(sum);
}

double logObjectness(const ModelDescription& model, const RawScores& raw) {
  if (!raw.objectness) return 0.0;
  const double value = *raw.objectness;
  if (!model.applied) return logSigmoid(value);
  return std::log(std::clamp(value, kLeastProbability, 1 - kLeastProbability));
}

float evidence(const Calibration& calibration, double log_odds) {
  return evidenceOf(calibration, std::clamp(log_odds, -kMaxLogit, kMaxLogit));
}

/// Returns true if the score is σ(o)·σ(c_k), as in most networks.
bool isPlainProduct(const ModelDescription& model) {
  return !model.class_softmax && model.objectness_exponent == 1.0 && model.class_exponent == 1.0;
}

/// Returns logit(σ(o) σ(c)) = −log(u + e^−c (1 + u)) with u = e^−o, which is exact and needs one
/// logarithm per class.
double logitOfProduct(double u, double c) {
  return u == 0.0 ? c : -std::log(u + std::exp(-c) * (1.0 + u));
}

/// Computes score and activations from objectness and classes, or from classes alone.
std::optional<std::size_t> weighAlone(const ModelDescription& model, const DecodeOptions& options,
                                      const RawScores& raw, Candidate& candidate) {
  const double log_threshold = std::log(options.score_threshold);
  const double log_objectness = logObjectness(model, raw);
  if (model.objectness_exponent * log_objectness < log_threshold) return std::nullopt;
  const Columns columns(model, raw);
  const auto best = bestOf(options, columns);
  if (!best) return std::nullopt;
  const double normaliser = model.class_softmax ? logSumExp(columns, model.classes.size()) : 0.0;
  const auto score = [&](std::size_t k) {
    const double value = columns.ofClass(k);
    return logScore(model, log_objectness,
                    model.class_softmax ? value - normaliser : logSigmoid(value));
  };
  const double highest = score(*best);
  if (highest < log_threshold) return std::nullopt;
  candidate.score = std::exp(highest);
  candidate.activations.reserve(options.wanted.size() + 1);
  candidate.activations.assign(1, 0.0F);
  if (isPlainProduct(model)) {
    const double odds_against = std::expm1(-log_objectness);
    for (const std::size_t k : options.wanted) {
      candidate.activations.push_back(
          evidence(model.calibration, logitOfProduct(odds_against, columns.ofClass(k))));
    }
    return best;
  }
  for (const std::size_t k : options.wanted) {
    candidate.activations.push_back(activation(model.calibration, score(k)));
  }
  return best;
}

/// Computes score and activations from a soft-max over classes and background.
std::optional<std::size_t> weighAgainstBackground(const ModelDescription& model,
                                                  const DecodeOptions& options,
                                                  const RawScores& raw, Candidate& candidate) {
  const Columns columns(model, raw);
  const auto best = bestOf(options, columns);
  if (!best) return std::nullopt;
  const std::size_t count = scoreColumns(model);
  double highest = columns.at(0), sum = 0;
  for (std::size_t i = 1; i < count; ++i) highest = std::max(highest, columns.at(i));
  for (std::size_t i = 0; i < count; ++i) sum += std::exp(columns.at(i) - highest);
  candidate.score = std::exp(columns.ofClass(*best) - highest) / sum;
  if (candidate.score < options.score_threshold) return std::nullopt;
  const double background = columns.at(model.background == Background::kFirst ? 0 : count - 1);
  candidate.activations.assign(1, 0.0F);
  for (const std::size_t k : options.wanted) {
    candidate.activations.push_back(evidence(model.calibration, columns.ofClass(k) - background));
  }
  return best;
}

}  // namespace

std::optional<std::size_t> weigh(const ModelDescription& model, const DecodeOptions& options,
                                 const RawScores& raw, Candidate& candidate) {
  const bool against = model.class_softmax && model.background != Background::kNone;
  return against ? weighAgainstBackground(model, options, raw, candidate)
                 : weighAlone(model, options, raw, candidate);
}

std::vector<double> softMax(const float* values, std::size_t step, std::size_t count) {
  std::vector<double> p(count);
  for (std::size_t i = 0; i < count; ++i) p[i] = values[i * step];
  const double highest = *std::max_element(p.begin(), p.end());
  for (double& value : p) value = std::exp(value - highest);
  const double sum = std::accumulate(p.begin(), p.end(), 0.0);
  for (double& value : p) value /= sum;
  return p;
}

}  // namespace perdure::inference
