// Likelihoods of all hypotheses of a track for all boxes (paper, eq. 7 at b = π(g s)), and
// correlation. Derivation: tools/docs/maths/measurement_likelihood.md.
#pragma once

#include <optional>
#include <vector>

#include "common/base/scratch.h"
#include "services/semantic_filter/core/belief/track.h"
#include "services/semantic_filter/core/measurement/cuboid_projection.h"
#include "services/semantic_filter/core/measurement/frame.h"
#include "services/semantic_filter/core/visibility/occlusion.h"

namespace perdure::semantic_filter {

/// What a hypothesis of a class should be detected as.
struct PredictedBox {
  ProjectedBox box;
  /// of the predicted sides, without noise, px²
  Eigen::Matrix4d covariance = Eigen::Matrix4d::Zero();
};
/// Returns nothing if no part of the object is before the camera.
std::optional<PredictedBox> predictBox(const Hypothesis& h, const State& x, const Projector& from,
                                       const BoxStyle& style, const PoseError& pose_error);

/// Who judges how a box is explained: the network, the view and what is assumed of both.
struct Judge {
  const Model* model;
  const View* view;
  const Parameters* parameters;
};
struct Explanation {
  double log_ratio = 0.0;  ///< of the likelihoods of the box, sides and class, to clutter, nats
  BoxScore sides;
};
/// Returns nothing outside the gate. `hidden`: by a nearer object. Last two: as for logRatio.
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
  double undetected = 0.0;             ///< v (1 - P_D): probability of visible and not reported
  double no_box = 1.0;  ///< A without a box: 1 - v P_D, with a top-down answer if there is one
  ScratchVector<BoxMatch> matches;  ///< for each of TrackScore::boxes
  double expected = 0.0;            ///< v P_D without the detection rate of earlier visits
  /// number of earlier observations with correlated errors, given this hypothesis
  double correlated_observations = 0.0;
};

/// Lives within one step.
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

/// Returns ψ: "it made this box" against "none, or does not exist". `box`: in TrackScore::boxes.
double associationWeight(const Track& track, const TrackScore& score, std::size_t box);

/// Returns the tempering exponent τ, because observations from one viewpoint share the errors of
/// the network: the information of one more after n correlated ones, I(n+1) - I(n) with I(n) = n /
/// (ρ n + 1 - ρ). Derivation: tools/docs/maths/class_and_existence_update.md.
double temperingExponent(double observations, double correlation);

/// Applies the network's answer at a predicted measurement without a box (paper, eq. 7;
/// services/inference/README.md, "Top-down"), as evidence of existence only. Derivation:
/// tools/docs/maths/joint_association.md, "Top-down likelihood". `log_ratio`: by class of the
/// model; if the model does not know the track's best class, nothing changes.
void applyTopDown(TrackScore& score, const Track& track, const std::vector<double>& log_ratio,
                  const FrameContext& frame);

}  // namespace perdure::semantic_filter
