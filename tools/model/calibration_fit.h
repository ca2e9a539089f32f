// Computes a calibration from the network's outputs for labelled boxes.
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

/// Returns the T, and the b if it is significant, that maximise the likelihood of the labels.
/// Source: Guo et al., "On calibration of modern neural networks", ICML 2017. The cost is convex in
/// β = 1/T and b, and is minimised by Newton's method. b is significant if it improves the Bayesian
/// information criterion. T is within [0.05, 20]. Returns T = 1 and b = 0 unless there are both
/// true boxes and clutter.
Softening fitSoftening(const std::vector<BoxOutcome>& boxes);

struct Reliability {
  struct Bin {
    double confidence = 0.0, right = 0.0;  ///< mean probability, and share of correct boxes
    std::size_t count = 0;
  };
  std::vector<Bin> bins;    ///< 15 bins of equal width of the best probability
  double error = 0.0;       ///< expected calibration error: Σ share · |confidence − right|
  double likelihood = 0.0;  ///< mean negative log-likelihood of the labels, nats for each box
  std::size_t boxes = 0;
};
/// Returns the reliability of the boxes; `calibrations[i]` is the calibration for box i.
Reliability reliabilityOf(const std::vector<BoxOutcome>& boxes,
                          const std::vector<Softening>& calibrations);

/// Fits a calibration for each box from the boxes of the other folds. A fold is a contiguous fifth
/// of the frames, because consecutive frames are similar.
std::vector<Softening> crossValidated(const std::vector<BoxOutcome>& boxes, std::size_t frames);

/// Returns the share of the boxes that are clutter, limited to [0.01, 0.99].
double clutterRateOf(const std::vector<BoxOutcome>& boxes);

/// Outcome for a predicted measurement without a box: whether the object exists, and the posterior
/// log-odds of its class from the best candidate near it, if any.
struct PrimedOutcome {
  bool there = false;
  std::optional<double> odds;
};
/// Fits a logistic regression of `there` on the odds. Without the prior odds of a true place, it
/// gives the log-likelihood ratio. Returns nothing for fewer than 40 places of either kind.
std::optional<inference::PrimedCalibration> fitPrimed(const std::vector<PrimedOutcome>& places,
                                                      double floor);

/// Returns the standard deviation, computed as 1.4826 times the median of the absolute values.
double robustSigma(std::vector<double> values);

}  // namespace perdure::tools
