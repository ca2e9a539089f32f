#include "services/semantic_filter/core/visibility/detectability.h"

#include <algorithm>
#include <cmath>

#include "services/semantic_filter/core/belief/view_change.h"

namespace perdure::semantic_filter {

namespace {

/// That something which stands, and is not on the map, hides it from here. When it comes back into
/// the picture, each score that is remembered from before vouches by itself for the views about its
/// own: what is not found where it was found then is gone rather than unmapped_occluder.
double unmappedOccluderFromHere(const Track& track, const Eigen::Vector3d& place,
                                const ViewWalk& walk) {
  double unmapped_occluder = walk.unmapped_occluder;
  for (const auto& k : track.batch.keyframes.read()) {
    if (k->from->time >= track.life.visit_began) break;  // they are in order of time
    unmapped_occluder *= 1.0 - std::exp(-viewChange(place, k->from->T_WC, walk.T_WC, walk.screen));
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

/// What is of no known class and looks like one is found as often as those of that class.
double detectionProbabilityOf(const Hypothesis& hypothesis, const Track& track, double size_px,
                              const FrameContext& frame) {
  const double own = detectionProbability(frame.priors->of(hypothesis.class_name), size_px, frame);
  if (hypothesis.class_name != kOtherClass) return own;
  const auto named = std::find_if(track.hypotheses.begin(), track.hypotheses.end(),
                                  [](const auto& h) { return h.class_name != kOtherClass; });
  if (named == track.hypotheses.end()) return own;
  const double lookalike_nats =
      lookalikeProbability(frame.parameters->clutter.other_lookalike, track.lookalike.nats);
  const ClassPrior& like = frame.priors->of(named->class_name);
  return (1.0 - lookalike_nats) * own + lookalike_nats * detectionProbability(like, size_px, frame);
}

/// How often the track is found from here, beside P_D.
double detectionRateFactor(const Track& track, const FrameContext& frame) {
  if (track.best().moving) return 1.0;
  return track.detectability.rate.factor(viewRayOf(track.best().x.head<3>(), frame.view.T_WC()),
                                         frame.parameters->tempering.detection_rate_prior,
                                         detectabilityScales(frame.parameters->visibility));
}

/// What may hide it from elsewhere is not known until it is seen from there.
void predictDetectability(Track& track, const ViewWalk& walk) {
  const Eigen::Vector3d place = track.best().x.head<3>();
  const double keep =
      track.views.predicted_from
          ? std::exp(-viewChange(place, *track.views.predicted_from, walk.T_WC, walk.screen))
          : 0.0;
  const double here = unmappedOccluderFromHere(track, place, walk);
  track.detectability.unmapped_occluder =
      here + keep * (track.detectability.unmapped_occluder - here);
  // What drives and is not found is lost rather than seldom found: it would take the boxes of what
  // stands where it was lost.
  track.detectability.hard_to_detect =
      track.best().moving
          ? 0.0
          : walk.hard_to_detect + keep * (track.detectability.hard_to_detect - walk.hard_to_detect);
  track.detectability.hard_to_detect =
      std::min(track.detectability.hard_to_detect, 1.0 - track.detectability.unmapped_occluder);
}

/// A frame that does not show the track says that it is unmapped_occluder, too, or hard_to_detect.
/// With A' where it is neither, A is 1 where it is unmapped_occluder and 1 + q (A' - 1), q the
/// share of P_D, where it is hard_to_detect.
void updateDetectability(Track& track, double mean_A, double hard_detection_share) {
  const double open = detectableShare(track, hard_detection_share);
  const double found = open > 0.0 ? hard_detection_share / open : 0.0;
  const double hard_to_detect =
      track.detectability.hard_to_detect * std::max(1.0 + found * (mean_A - 1.0), 0.0);
  track.detectability.unmapped_occluder =
      std::min(1.0, track.detectability.unmapped_occluder / mean_A);
  track.detectability.hard_to_detect =
      std::min(1.0 - track.detectability.unmapped_occluder, hard_to_detect / mean_A);
}

}  // namespace perdure::semantic_filter
