// Top-down likelihood: the network's output at places where objects are predicted but no box was
// reported (eq. 7 takes the likelihood at the predicted projection; README, "Top-down").
//
// The best of many candidates is a selection, because near any place some candidate has a low
// score. The likelihood ratio therefore compares two cases in which no box was reported: the best
// candidate near a place with the object, and near a place without one. PrimedCalibration holds
// this ratio; `perdure model calibrate` fits it with the same selection.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "common/types/objects.h"
#include "common/types/sensors.h"
#include "services/inference/core/decode/decode.h"

namespace perdure::inference {

/// Predicted box, a Gaussian in its four sides.
struct Expectation {
  Box box;                             ///< pixels of the network's input
  std::size_t activation = 1;          ///< index of its class in Candidate::activations
  std::array<double, 4> side_sigma{};  ///< standard deviation of the prediction, pixels of the
                                       ///< input
};

/// Answer to an expectation without a matching reported box.
struct PrimedAnswer {
  std::size_t expectation = 0;
  std::optional<std::size_t> candidate;  ///< the best candidate near it; empty if there is none
  double odds = 0.0;  ///< log-odds of the class, minus ½ of the candidate's squared distance
};

/// Least IoU at which a reported box matches an expectation, and at which a candidate is near it.
inline constexpr double kMet = 0.6, kNear = 0.4;

/// Matches reported boxes and expectations one to one, by falling overlap, and answers the other
/// expectations. The boxes of several objects in a row are often merged into one, but their
/// candidates are separate. A candidate therefore belongs to the expectation that it overlaps most,
/// even if it was merged. If it overlaps an unmatched reported box more, it belongs to that box.
///
/// The best candidate of an expectation has the highest log-odds of the class − ½ Σ d² / σ², where
/// σ² is the sum of the variances of prediction and box. The result has one answer for each
/// unmatched expectation, in their order.
std::vector<PrimedAnswer> prime(const Calibration& calibration,
                                const std::vector<Expectation>& expected,
                                const std::vector<Candidate>& reported,
                                const std::vector<Candidate>& candidates);

/// Returns the candidate with the weighted mean of its box and the prediction. Sides are weighted
/// by their inverse variances.
Candidate fused(const Expectation& expectation, const Candidate& candidate);

/// Returns log P(answer | object present, unreported) / P(answer | no object), in nats within ±5.
double primedLogRatio(const PrimedCalibration& primed, const PrimedAnswer& answer);

/// Time after their frame for which predictions are valid.
inline constexpr double kPrimedHorizon_s = 0.5;

/// Returns true if the predictions have the frame's camera and source, and if their frame is at
/// most kPrimedHorizon_s older than this frame and not later.
bool fitsFrame(const Predictions& predictions, const Frame& frame);

Box movedOn(const Prediction& prediction, double after);

}  // namespace perdure::inference
