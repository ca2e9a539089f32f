// From what a network said of labelled boxes to its calibration: pure functions.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "services/inference/core/description.h"

namespace perdure::tools {

/// One reported box: the network's own log-odds of each class against clutter, and what was there.
struct BoxOutcome {
  std::size_t frame = 0;     ///< position among the frames looked at
  std::vector<double> odds;  ///< K, before calibration
  std::size_t label = 0;     ///< 0 clutter, k + 1 class k
};

/// p = softmax(0, odds_1 / T + b, …, odds_K / T + b).
struct Softening {
  double temperature = 1.0, bias = 0.0;
};

/// T, and b where it pays, at which the labels are most likely (Guo et al., "On calibration of
/// modern neural networks", ICML 2017). In β = 1/T and b the cost is convex: Newton's method. b is
/// kept where it gains more than it costs by the Bayesian information criterion. T within
/// [0.05, 20]. Without boxes of both kinds: no change.
Softening fitSoftening(const std::vector<BoxOutcome>& boxes);

struct Reliability {
  struct Bin {
    double confidence = 0.0, right = 0.0;  ///< means
    std::size_t count = 0;
  };
  std::vector<Bin> bins;    ///< of the best class's probability, 15 of equal width
  double error = 0.0;       ///< expected calibration error: Σ share · |confidence − right|
  double likelihood = 0.0;  ///< mean negative log-likelihood of the labels, nats a box
  std::size_t boxes = 0;
};
/// `calibrations[i]` is what box i is judged with: that of its fold.
Reliability reliabilityOf(const std::vector<BoxOutcome>& boxes,
                          const std::vector<Softening>& calibrations);

/// Each box is judged by a fit to the boxes of the other folds; a fold is an unbroken fifth of the
/// frames, since frames that follow each other are alike.
std::vector<Softening> crossValidated(const std::vector<BoxOutcome>& boxes, std::size_t frames);

/// Share of the boxes that are clutter, kept within [0.01, 0.99].
double clutterRateOf(const std::vector<BoxOutcome>& boxes);

/// A place that was asked about and that no box met: whether the thing was there, and the posterior
/// log-odds of its class by the best candidate near it, where there is one.
struct PrimedOutcome {
  bool there = false;
  std::optional<double> odds;
};
/// Logistic regression of `there` on the odds; what is left of it without the share of places that
/// were there is the log-likelihood ratio. Nothing where there are under 40 of either kind.
std::optional<inference::PrimedCalibration> fitPrimed(const std::vector<PrimedOutcome>& places,
                                                      double floor);

/// Standard deviation from the median of the absolute values (× 1.4826).
double robustSigma(std::vector<double> values);
double medianOf(std::vector<double> values);

}  // namespace perdure::tools
