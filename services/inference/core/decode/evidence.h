// Scores as log-likelihood ratios (eq. 7: activations before the soft-max, one of them clutter).
// Clutter is the reference: activations[0] = 0. For a score p of class k,
//   activations[k] = logit(p) / T + b + logit(c),
// with the temperature T, the bias b, and the share c of clutter among the reported boxes; README,
// "Clutter".
#pragma once

#include <algorithm>
#include <cmath>

#include "services/inference/core/description.h"

namespace perdure::inference {

/// Returns log σ(x), exact for large |x|.
inline double logSigmoid(double x) {
  return x < 0 ? x - std::log1p(std::exp(x)) : -std::log1p(std::exp(-x));
}

inline double sigmoid(double x) { return std::exp(logSigmoid(x)); }

inline double logit(double p) { return std::log(p) - std::log1p(-p); }

/// Limit ±kMaxLogit of activations, so that no single detection is certain.
inline constexpr double kMaxLogit = 30.0;

/// Returns logit(p) from log p ≤ 0, exact for p near 0 and near 1.
inline double logitFromLog(double log_p) {
  if (log_p >= 0) return kMaxLogit;
  return std::clamp(log_p - std::log(-std::expm1(log_p)), -kMaxLogit, kMaxLogit);
}

/// Returns the logarithm of objectness^a · class^b.
inline double logScore(const ModelDescription& model, double log_objectness, double log_class) {
  return model.objectness_exponent * log_objectness + model.class_exponent * log_class;
}

/// Returns the calibrated log-likelihood ratio of a class against clutter, from the network's own
/// log-odds.
inline float evidenceOf(const Calibration& calibration, double log_odds) {
  return static_cast<float>(log_odds / calibration.temperature + calibration.bias +
                            logit(calibration.clutter_rate));
}

/// Inverse of evidenceOf(): returns the network's own log-odds.
inline double oddsOf(const Calibration& calibration, double evidence) {
  return (evidence - calibration.bias - logit(calibration.clutter_rate)) * calibration.temperature;
}

/// Returns evidenceOf() for the logarithm of a score.
inline float activation(const Calibration& calibration, double log_score) {
  return evidenceOf(calibration, logitFromLog(log_score));
}

}  // namespace perdure::inference
