#include "services/semantic_filter/core/association/score.h"

#include <algorithm>

#include "services/semantic_filter/core/visibility/detectability.h"

namespace perdure::semantic_filter {

namespace {

constexpr double kMaxLogLikelihood = 40.0;  // nats, keeps products finite
constexpr double kMaxDetection = 0.98;      // largest v P_D, as a share of v

/// Returns the number of earlier observations that share the errors of this view of `position`.
double correlatedObservations(const Eigen::Vector3d& position, const Viewpoint& last,
                              const View& view, const TemperingParameters& parameters) {
  if (last.observations <= 0.0) return 0.0;
  const double correlation =
      viewCorrelation(position, last.T_WC, view.T_WC(),
                      {parameters.angle, parameters.log_distance, parameters.image_angle});
  return last.observations * correlation;
}

/// Returns the log clutter density of the compared sides. Its unit depends on their number.
double logClutterOf(const BoxDetection& e, const BoxScore& score, const View& view,
                    const ClutterParameters& parameters) {
  const auto& ignored = score.ignored;
  if (std::none_of(ignored.begin(), ignored.end(), [](bool i) { return i; })) {
    return e.log_clutter + e.log_partial_views;
  }
  return e.log_partial_views +
         logClutter(e.z, view.camera->width(), view.camera->height(), parameters, ignored);
}

HypothesisScore scoreHypothesis(const Hypothesis& hypothesis, const Track& track, double rate,
                                const TrackVisibility& visibility, const Projector& from,
                                const FrameContext& frame) {
  HypothesisScore h;
  h.predicted = predictBox(hypothesis, hypothesis.x, from, frame.styleOf(hypothesis.class_name),
                           frame.pose_error);
  h.correlated_observations = correlatedObservations(
      hypothesis.x.head<3>(), track.views.observed_from, frame.view, frame.parameters->tempering);
  if (!h.predicted) return h;
  const Eigen::Vector4d& sides = h.predicted->box.sides;
  const double size = std::sqrt((sides[2] - sides[0]) * (sides[3] - sides[1]));
  const double v = visibility.fraction * (1.0 - track.detectability.unmapped_occluder);
  h.expected = visibility.fraction *
               detectableShare(track, frame.parameters->visibility.hard_detection_share) *
               detectionProbabilityOf(hypothesis, track, size, frame);
  h.detection_probability = std::min(h.expected * rate, kMaxDetection * v);
  h.undetected = v - h.detection_probability;
  h.no_box = 1.0 - h.detection_probability;
  return h;
}

/// Bounds of the boxes that mayOverlap can accept. They reject most boxes at little cost.
struct Reach {
  double least[2], most[2];

  /// Returns false only if mayOverlap rejects the box for every hypothesis.
  bool touches(const BoxMeasurement& z) const {
    for (int axis = 0; axis < 2; ++axis) {
      if (z.sides[axis] > most[axis] || z.sides[axis + 2] < least[axis]) return false;
    }
    return true;
  }
};

Reach reachOf(const ScratchVector<HypothesisScore>& hypotheses,
              const std::vector<BoxDetection>& boxes) {
  constexpr double kFar = 1e30, kReach = 5.01;  // deviations, slightly more than in mayOverlap
  double noise[2] = {0.0, 0.0};
  for (const BoxDetection& e : boxes) {
    for (int axis = 0; axis < 2; ++axis) noise[axis] = std::max(noise[axis], e.z.variance[axis]);
  }
  Reach reach{{kFar, kFar}, {-kFar, -kFar}};
  for (const HypothesisScore& h : hypotheses) {
    if (!h.predicted) continue;
    const Eigen::Vector4d& sides = h.predicted->box.sides;
    const Eigen::Matrix4d& covariance = h.predicted->covariance;
    for (int axis = 0; axis < 2; ++axis) {
      const double variance = std::max(covariance(axis, axis), covariance(axis + 2, axis + 2));
      const double far = kReach * std::sqrt(std::max(variance + noise[axis], 0.0));
      const double least = sides[axis] - far, most = sides[axis + 2] + far;
      if (!std::isfinite(least + most)) return {{-kFar, -kFar}, {kFar, kFar}};
      reach.least[axis] = std::min(reach.least[axis], least);
      reach.most[axis] = std::max(reach.most[axis], most);
    }
  }
  return reach;
}

}  // namespace

std::optional<PredictedBox> predictBox(const Hypothesis& h, const State& x, const Projector& from,
                                       const BoxStyle& style, const PoseError& pose_error) {
  std::optional<PredictedBox> predicted;
  const auto box = projectObserved(x, from, style, h.heading());
  if (box) predicted = {*box, predictedCovariance(h, *box, pose_error.covariance)};
  return predicted;
}

std::optional<Explanation> explain(const BoxDetection& detection, const PredictedBox& predicted,
                                   const std::array<bool, 4>& hidden, const std::string& class_name,
                                   double lookalike_nats, const Judge& judge) {
  const auto& [box, covariance] = predicted;
  if (!mayOverlap(detection.z, box, covariance)) return std::nullopt;
  const auto sides = scoreBox(detection.z, box, covariance, hidden, judge.parameters->box);
  if (!sides) return std::nullopt;
  const double log_ratio = logRatio(detection, *judge.model, class_name, lookalike_nats) +
                           sides->log_density -
                           logClutterOf(detection, *sides, *judge.view, judge.parameters->clutter);
  return Explanation{log_ratio, *sides};
}

TrackScore scoreTrack(const Track& track, const TrackVisibility& visibility,
                      const std::vector<BoxDetection>& boxes, const FrameContext& frame) {
  TrackScore result;
  result.visibility = visibility;
  result.hypotheses.reserve(track.hypotheses.size());
  const Projector from = frame.projector();
  const Judge judge{frame.model, &frame.view, frame.parameters};
  const double rate = detectionRateFactor(track, frame);
  for (const auto& hypothesis : track.hypotheses) {
    result.hypotheses.push_back(scoreHypothesis(hypothesis, track, rate, visibility, from, frame));
  }
  const Reach reach = reachOf(result.hypotheses, boxes);
  for (std::size_t z = 0; z < boxes.size(); ++z) {
    if (!reach.touches(boxes[z].z)) continue;
    const bool near = std::any_of(
        result.hypotheses.begin(), result.hypotheses.end(), [&](const HypothesisScore& h) {
          return h.predicted && mayOverlap(boxes[z].z, h.predicted->box, h.predicted->covariance);
        });
    if (near) result.boxes.push_back(z);
  }
  for (std::size_t i = 0; i < result.hypotheses.size(); ++i) {
    HypothesisScore& h = result.hypotheses[i];
    h.matches.assign(result.boxes.size(), {});
    for (std::size_t k = 0; h.predicted && k < result.boxes.size(); ++k) {
      const auto why = explain(boxes[result.boxes[k]], *h.predicted, visibility.hidden_sides,
                               track.hypotheses[i].class_name, track.lookalike.nats, judge);
      if (!why) continue;
      h.matches[k] = {std::exp(std::min(why->log_ratio, kMaxLogLikelihood)),
                      why->sides.nis / why->sides.dof, why->sides.part};
    }
  }
  return result;
}

std::array<bool, 4> hiddenSides(const TrackScore& score, std::size_t box,
                                const BoxDetection& detection) {
  std::array<bool, 4> hidden = withSidesBesideNearer(score.visibility.hidden_sides, detection);
  const auto at = std::find(score.boxes.begin(), score.boxes.end(), box) - score.boxes.begin();
  const auto i = static_cast<std::size_t>(at);
  if (i == score.boxes.size()) return hidden;
  const auto best = std::max_element(score.hypotheses.begin(), score.hypotheses.end(),
                                     [i](const auto& a, const auto& b) {
                                       return a.matches[i].likelihood < b.matches[i].likelihood;
                                     });
  const int part = best->matches[i].part;
  if (part >= 0) hidden[static_cast<std::size_t>(part)] = true;
  return hidden;
}

double associationWeight(const Track& track, const TrackScore& score, std::size_t box) {
  double reported = 0.0, unreported = 0.0;
  for (std::size_t i = 0; i < track.hypotheses.size(); ++i) {
    const HypothesisScore& h = score.hypotheses[i];
    reported += track.hypotheses[i].weight * h.detection_probability * h.matches[box].likelihood;
    unreported += track.hypotheses[i].weight * h.no_box;
  }
  const double r = track.existence;
  return r * reported / std::max(1.0 - r + r * unreported, 1e-12);
}

double temperingExponent(double observations, double correlation) {
  const auto information = [&](double n) { return n / (correlation * n + 1.0 - correlation); };
  return information(observations + 1.0) - information(observations);
}

void applyTopDown(TrackScore& score, const Track& track, const std::vector<double>& log_ratio,
                  const FrameContext& frame) {
  const auto k = frame.model->index.find(track.best().class_name);
  if (k == frame.model->index.end() || k->second >= log_ratio.size()) return;
  // Evidence for the object is tempered, because it shares errors with earlier observations.
  // Evidence against it is limited by the probability of an unmapped occluder.
  double nats = log_ratio[k->second];
  if (nats > 0.0) {
    nats *= temperingExponent(score.hypotheses.front().correlated_observations,
                              frame.parameters->tempering.correlation);
  }
  for (HypothesisScore& h : score.hypotheses) {
    h.no_box =
        std::max(1.0 - h.detection_probability + h.undetected * (std::exp(nats) - 1.0), 1e-6);
  }
  score.top_down = true;
}

}  // namespace perdure::semantic_filter
