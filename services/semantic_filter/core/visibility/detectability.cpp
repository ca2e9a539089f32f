#include "services/semantic_filter/core/visibility/detectability.h"

#include <algorithm>
#include <cmath>

#include "services/semantic_filter/core/belief/view_change.h"

namespace perdure::semantic_filter {

namespace {

/// Returns the stationary probability that an unmapped static object hides the track from this
/// camera. It is 0 up to a distance at which the track was detected from this direction.
double stationaryOccluder(const Track& track, const RigidTransform& T_WC, const ViewWalk& walk) {
  const Eigen::Vector3d ray = track.best().x.head<3>() - T_WC.p;
  const double azimuth = std::atan2(ray.y(), ray.x()), distance = ray.norm();
  double free = 0.0;
  for (int k = 0; k < kDirections; ++k) {
    const double seen = track.detectability.seen_from[k];
    if (seen <= 0.0) continue;
    const double beyond = std::max(0.0, std::log(distance / seen));
    free = std::max(free, std::exp(-angleToSector(k, azimuth) / walk.occluder.angle -
                                   beyond / walk.detectability.log_distance));
  }
  return walk.unmapped_occluder * (1.0 - free);
}

/// Returns the probability of an occluder after a motion along the ray. `s`: before the motion.
/// `before`, `now`: stationary values. Such a motion only passes occluders or only adds some.
double alongTheRay(double s, double before, double now) {
  return now <= before ? (before > 0.0 ? s * now / before : s)
                       : s + (1.0 - s) * (now - before) / (1.0 - before);
}

constexpr double kSizeSpread = 0.2;  // relative, of the sizes at which objects are detected

/// Returns the difference of a size from that at which P_D is halved, in spreads.
double overHalfSize(double size_px, const FrameContext& frame) {
  const BoxParameters& box = frame.parameters->box;
  double half = box.min_size_px;
  if (frame.model && frame.model->input_width > 0.0) {
    half = box.min_network_px * frame.view.camera->width() / frame.model->input_width;
  }
  half *= frame.size_scale;
  return (size_px - half) / (kSizeSpread * half);
}

}  // namespace

double detectableShare(const Track& track, double hard_detection_share) {
  return 1.0 - track.detectability.unmapped_occluder -
         (1.0 - hard_detection_share) * track.detectability.hard_to_detect;
}

double detectionProbability(const ClassPrior& prior, double size_px, const FrameContext& frame) {
  return prior.detection_probability / (1.0 + std::exp(-overHalfSize(size_px, frame)));
}

SizeEvidence sizeEvidence(const ClassPrior& prior, double size_px, bool detected,
                          const FrameContext& frame) {
  const double x = overHalfSize(size_px, frame);
  const double share = 1.0 / (1.0 + std::exp(-x));
  const double P = std::clamp(prior.detection_probability * share, 0.02, 0.98);
  const double slope = -P * (1.0 - share) * (x + 1.0 / kSizeSpread);  // dP / dlog of the half size
  const double variance = P * (1.0 - P);
  return {((detected ? 1.0 : 0.0) - P) * slope / variance, slope * slope / variance};
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
  const double stationary = stationaryOccluder(track, walk.T_WC, walk);
  double& occluder = track.detectability.unmapped_occluder;
  if (const auto& before = track.views.predicted_from)
    occluder = alongTheRay(occluder, stationaryOccluder(track, *before, walk), stationary);
  occluder = stationary + keepWith(walk.occluder) * (occluder - stationary);
  const double keep = keepWith(walk.detectability);
  // A moving undetected track counts as lost. If it stayed, it would take boxes of other objects.
  track.detectability.hard_to_detect =
      track.best().moving
          ? 0.0
          : walk.hard_to_detect + keep * (track.detectability.hard_to_detect - walk.hard_to_detect);
  track.detectability.hard_to_detect =
      std::min(track.detectability.hard_to_detect, 1.0 - track.detectability.unmapped_occluder);
}

/// A miss makes both causes more likely. If A' is A without them, A is 1 behind an unmapped
/// occluder, and 1 + q (A' - 1) if the object is hard to detect, with q = `hard_detection_share`.
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
