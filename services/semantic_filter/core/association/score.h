// Likelihoods of all hypotheses of a track for all boxes (paper, eq. 7 at b = π(g s)), and the
// correlation of observations. Derivation: tools/docs/maths/measurement_likelihood.md.
#pragma once

#include <optional>
#include <vector>

#include "common/base/scratch.h"
#include "services/semantic_filter/core/belief/track.h"
#include "services/semantic_filter/core/measurement/cuboid_projection.h"
#include "services/semantic_filter/core/measurement/frame.h"
#include "services/semantic_filter/core/visibility/occlusion.h"

namespace perdure::semantic_filter {

/// The box that the network is expected to report for a hypothesis.
struct PredictedBox {
  ProjectedBox box;
  /// covariance of the predicted sides without measurement noise, px²
  Eigen::Matrix4d covariance = Eigen::Matrix4d::Zero();
};
/// Predicts the box of a hypothesis in state `x`. Returns nothing if no part of the object is in
/// front of the camera.
std::optional<PredictedBox> predictBox(const Hypothesis& h, const State& x, const Projector& from,
                                       const BoxStyle& style, const PoseError& pose_error);

/// The network, the view and the parameters by which a box is scored.
struct Judge {
  const Model* model;
  const View* view;
  const Parameters* parameters;
};
struct Explanation {
  double log_ratio = 0.0;  ///< of the likelihood of the box (sides and class) to clutter, nats
  BoxScore sides;
};
/// Scores a detection against a predicted box. Returns nothing if it is outside the gate. `hidden`:
/// sides that a nearer object hides. `class_name` and `lookalike_nats`: as for logRatio.
std::optional<Explanation> explain(const BoxDetection& detection, const PredictedBox& predicted,
                                   const std::array<bool, 4>& hidden, const std::string& class_name,
                                   double lookalike_nats, const Judge& judge);

struct BoxMatch {
  double likelihood = 0.0;  ///< L(z), 0 outside the gate
  double nis = 0.0;         ///< normalised innovation per degree of freedom, if likelihood > 0
  int part = -1;            ///< BoxScore::part
};

struct HypothesisScore {
  std::optional<PredictedBox> predicted;
  double detection_probability = 0.0;  ///< v P_D: probability that the network reports the object
  double undetected = 0.0;             ///< v (1 - P_D): visible, but not reported
  double no_box = 1.0;              ///< A without a box: 1 - v P_D, as changed by a top-down answer
  ScratchVector<BoxMatch> matches;  ///< one for each of TrackScore::boxes
  double expected = 0.0;            ///< v P_D without the detection rate of earlier visits
  /// number of earlier observations with correlated errors, given this hypothesis
  double correlated_observations = 0.0;
};

/// Scores of one track. The memory is valid within one step only.
struct TrackScore {
  TrackVisibility visibility;
  bool top_down = false;             ///< a top-down answer is applied (applyTopDown)
  ScratchVector<std::size_t> boxes;  ///< indices of the frame's boxes that are near a hypothesis
  ScratchVector<HypothesisScore> hypotheses;
};

TrackScore scoreTrack(const Track& track, const TrackVisibility& visibility,
                      const std::vector<BoxDetection>& boxes, const FrameContext& frame);

/// Returns the hidden sides, given the hypothesis that explains `box` (index in the frame) best.
std::array<bool, 4> hiddenSides(const TrackScore& score, std::size_t box,
                                const BoxDetection& detection);

/// Returns ψ: the weight of "the track made this box" against "it made none, or does not exist".
/// `box`: index in TrackScore::boxes.
double associationWeight(const Track& track, const TrackScore& score, std::size_t box);

/// Returns the tempering exponent τ = I(n + 1) - I(n): the information of one more observation
/// after n = `observations` with correlated errors. I(n) = n / (ρ n + 1 - ρ), ρ = `correlation`.
/// Derivation: tools/docs/maths/class_and_existence_update.md.
double temperingExponent(double observations, double correlation);

/// Applies the network's answer at a predicted measurement without a box (paper, eq. 7;
/// services/inference/README.md, "Top-down"), as evidence of existence only. Derivation:
/// tools/docs/maths/joint_association.md, "Top-down likelihood". `log_ratio`: nats, one for each
/// class of the model. If the model does not have the track's best class, nothing changes.
void applyTopDown(TrackScore& score, const Track& track, const std::vector<double>& log_ratio,
                  const FrameContext& frame);

}  // namespace perdure::semantic_filter
