// Computes a calibration from the network's outputs for labelled boxes; pure functions.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "services/inference/core/description.h"

namespace perdure::tools {

/// One reported box: the network's log-odds of each class against clutter, and the true label.
struct BoxOutcome {
  std::size_t frame = 0;     ///< index among the examined frames
  std::vector<double> odds;  ///< K values, before calibration
  std::size_t label = 0;     ///< 0: clutter, k + 1: class k
};

/// p = softmax(0, odds_1 / T + b, …, odds_K / T + b).
struct Softening {
  double temperature = 1.0, bias = 0.0;
};

/// The T, and b if it is significant, that maximise the likelihood of the labels. Source: Guo et
/// al., "On calibration of modern neural networks", ICML 2017. The cost is convex in β = 1/T and b,
/// and is minimised by Newton's method. b is used if it improves the Bayesian information
/// criterion. T is within [0.05, 20]. Returns no change unless there are boxes of both kinds.
Softening fitSoftening(const std::vector<BoxOutcome>& boxes);

struct Reliability {
  struct Bin {
    double confidence = 0.0, right = 0.0;  ///< means
    std::size_t count = 0;
  };
  std::vector<Bin> bins;    ///< 15 bins of equal width, over the best probability
  double error = 0.0;       ///< expected calibration error: Σ share · |confidence − right|
  double likelihood = 0.0;  ///< mean negative log-likelihood of the labels, nats for each box
  std::size_t boxes = 0;
};
/// `calibrations[i]`: the calibration for box i, from its fold.
Reliability reliabilityOf(const std::vector<BoxOutcome>& boxes,
                          const std::vector<Softening>& calibrations);

/// Fits a calibration for each box from the boxes of the other folds. A fold is a contiguous fifth
/// of the frames, because consecutive frames are similar.
std::vector<Softening> crossValidated(const std::vector<BoxOutcome>& boxes, std::size_t frames);

/// Share of the boxes that are clutter, limited to [0.01, 0.99].
double clutterRateOf(const std::vector<BoxOutcome>& boxes);

/// Outcome for a predicted measurement without a box: whether the object exists, and the posterior
/// log-odds of its class by the best candidate near it, if there is one.
struct PrimedOutcome {
  bool there = false;
  std::optional<double> odds;
};
/// Logistic regression of `there` on the odds. Its result without the share of true places is the
/// log-likelihood ratio. Empty if there are fewer than 40 of either kind.
std::optional<inference::PrimedCalibration> fitPrimed(const std::vector<PrimedOutcome>& places,
                                                      double floor);

/// Standard deviation from the median of the absolute values (× 1.4826).
double robustSigma(std::vector<double> values);

}  // namespace perdure::tools
