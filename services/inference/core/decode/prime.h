// Top-down: what the network says at the places where objects are expected and no box was reported
// (eq. 7 takes the likelihood at the predicted projection; README, "Top-down").
//
// The best of many candidates is a selection: near any place one of them says a little. Its
// likelihood ratio is therefore not the candidate's own, but that of "the best near a place where
// the thing is" against "the best near a place where nothing is", both where no box was reported
// (PrimedCalibration, fitted by `perdure model calibrate` through this same selection).
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "common/types/objects.h"
#include "common/types/sensors.h"
#include "services/inference/core/decode/decode.h"

namespace perdure::inference {

/// Where a box should be: a Gaussian in its four sides.
struct Expectation {
  Box box;                             ///< pixels of the network's input
  std::size_t activation = 1;          ///< position of its class in Candidate::activations
  std::array<double, 4> side_sigma{};  ///< of the prediction, pixels of the input
};

/// The answer to an expectation that no reported box meets.
struct PrimedAnswer {
  std::size_t expectation = 0;
  std::optional<std::size_t> candidate;  ///< the best near it; nothing where there is none
  double odds = 0.0;  ///< what it says: log-odds of the class, less ½ of its squared distance
};

/// IoU from which a reported box meets an expectation, and from which a candidate is near it.
inline constexpr double kMet = 0.6, kNear = 0.4;

/// Reported boxes meet expectations one to one, those that overlap most first. Of a row of things
/// in line the boxes are often merged into one; the candidates know them apart. So a candidate
/// speaks for the expectation that it overlaps most, whatever it was merged into, unless it
/// overlaps a reported box more that meets no expectation: then it is that one's. Of an
/// expectation's candidates the one wins that is likeliest by its activation and its place:
/// the highest log-odds of the class − ½ Σ d² / σ², σ of the prediction and of the box together.
/// In order of the expectations.
std::vector<PrimedAnswer> prime(const Calibration& calibration,
                                const std::vector<Expectation>& expected,
                                const std::vector<Candidate>& reported,
                                const std::vector<Candidate>& candidates);

/// Where the thing is, by prediction and box together, each side weighed by its variance.
Candidate fused(const Expectation& expectation, const Candidate& candidate);

/// log P(answer | it is there, unreported) / P(answer | nothing is there), nats.
double primedLogRatio(const PrimedCalibration& primed, const PrimedAnswer& answer);

/// How long after their frame predictions are of use.
inline constexpr double kPrimedHorizon_s = 0.5;

/// Whether the predictions are of this frame's camera and source, and of a frame not later than it
/// and not older than kPrimedHorizon_s.
bool fitsFrame(const Predictions& predictions, const Frame& frame);

/// The predicted box `after` seconds.
Box movedOn(const Prediction& prediction, double after);

}  // namespace perdure::inference
