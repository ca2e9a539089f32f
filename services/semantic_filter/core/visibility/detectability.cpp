#include "services/semantic_filter/core/visibility/detectability.h"

#include <algorithm>
#include <cmath>

#include "services/semantic_filter/core/belief/view_change.h"

namespace perdure::semantic_filter {

namespace {

/// Returns the stationary probability, at this view, that an unmapped static object hides the
/// track. Keyframes of earlier visits lower it near their views.
double stationaryOccluder(const Track& track, const Eigen::Vector3d& place, const ViewWalk& walk) {
  double unmapped_occluder = walk.unmapped_occluder;
  for (const auto& k : track.batch.keyframes.read()) {
    if (k->from->time >= track.life.visit_began) break;  // keyframes are in order of time
    unmapped_occluder *= 1.0 - viewCorrelation(place, k->from->T_WC, walk.T_WC, walk.occluder);
  }
  return unmapped_occluder;
}

}  // namespace

double detectableShare(const Track& track, double hard_detection_share) {
  return 1.0 - track.detectability.unmapped_occluder -
         (1.0 - hard_detection_share) * track.detectability.hard_to_detect;
}

double detectionProbability(const ClassPrior& prior, double size_px, const FrameContext& frame) {
  const BoxParameters& box = frame.parameters->box;
  double half = box.min_size_px;
  if (frame.model && frame.model->input_width > 0.0) {
    half = box.min_network_px * frame.view.camera->width() / frame.model->input_width;
  }
  return prior.detection_probability / (1.0 + std::exp(-(size_px - half) / (0.2 * half)));
}

double detectionProbabilityOf(const Hypothesis& hypothesis, const Track& track, double size_px,
                              const FrameContext& frame) {
  const double own = detectionProbability(frame.priors->of(hypothesis.class_name), size_px, frame);
  if (hypothesis.class_name != kOtherClass) return own;
  const auto named = std::find_if(track.hypotheses.begin(), track.hypotheses.end(),
                                  [](const auto& h) { return h.class_name != kOtherClass; });
  if (named == track.hypotheses.end()) return own;
  const double p_lookalike =
      lookalikeProbability(frame.parameters->clutter.other_lookalike, track.lookalike.nats);
  const ClassPrior& like = frame.priors->of(named->class_name);
  return (1.0 - p_lookalike) * own + p_lookalike * detectionProbability(like, size_px, frame);
}

double detectionRateFactor(const Track& track, const FrameContext& frame) {
  if (track.best().moving) return 1.0;
  return track.detectability.rate.factor(viewRayOf(track.best().x.head<3>(), frame.view.T_WC()),
                                         frame.parameters->tempering.detection_rate_prior,
                                         detectabilityScales(frame.parameters->visibility));
}

void predictDetectability(Track& track, const ViewWalk& walk) {
  const Eigen::Vector3d place = track.best().x.head<3>();
  const auto keepWith = [&](const ViewScales& scales) {
    const auto& before = track.views.predicted_from;
    return before ? viewCorrelation(place, *before, walk.T_WC, scales) : 0.0;
  };
  const double stationary = stationaryOccluder(track, place, walk);
  track.detectability.unmapped_occluder =
      stationary + keepWith(walk.occluder) * (track.detectability.unmapped_occluder - stationary);
  const double keep = keepWith(walk.detectability);
  // A moving undetected track is lost rather than hard to detect: it would take other boxes.
  track.detectability.hard_to_detect =
      track.best().moving
          ? 0.0
          : walk.hard_to_detect + keep * (track.detectability.hard_to_detect - walk.hard_to_detect);
  track.detectability.hard_to_detect =
      std::min(track.detectability.hard_to_detect, 1.0 - track.detectability.unmapped_occluder);
}

/// A miss makes both reasons more likely. If A' is A without them, A is 1 behind an unmapped
/// occluder, and 1 + q (A' - 1) where the object is hard to detect, q being the share of P_D.
void updateDetectability(Track& track, double mean_A, double hard_detection_share) {
  const double detectable = detectableShare(track, hard_detection_share);
  const double hard_share = detectable > 0.0 ? hard_detection_share / detectable : 0.0;
  const double hard_to_detect =
      track.detectability.hard_to_detect * std::max(1.0 + hard_share * (mean_A - 1.0), 0.0);
  track.detectability.unmapped_occluder =
      std::min(1.0, track.detectability.unmapped_occluder / mean_A);
  track.detectability.hard_to_detect =
      std::min(1.0 - track.detectability.unmapped_occluder, hard_to_detect / mean_A);
}

}  // namespace perdure::semantic_filter
