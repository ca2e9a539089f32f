#include "services/semantic_filter/core/association/score.h"

#include <algorithm>
#include <cmath>

#include "services/semantic_filter/core/association/tempering.h"
#include "services/semantic_filter/core/visibility/detectability.h"

namespace perdure::semantic_filter {

namespace {

constexpr double kMaxLogLikelihood = 40.0;  // nats, keeps products finite
constexpr double kMostFound = 0.98;

void scoreBoxes(HypothesisLook& h, const std::string& class_name, double alike,
                const ObjectLook& look, const std::vector<Evidence>& boxes,
                const FrameContext& frame) {
  for (std::size_t i = 0; i < look.boxes.size(); ++i) {
    const Evidence& e = boxes[look.boxes[i]];
    if (!mayOverlap(e.z, *h.box, h.covariance)) continue;
    const auto score =
        scoreBox(e.z, *h.box, h.covariance, look.sight.hidden, frame.parameters->box);
    if (!score) continue;
    const double log_l = logRatio(e, *frame.model, class_name, alike) + score->log_density -
                         logClutterOf(e, *score, frame.view, frame.parameters->clutter);
    h.fits[i] = {std::exp(std::min(log_l, kMaxLogLikelihood)), score->nis / score->dof,
                 score->part};
  }
}

HypothesisLook lookAt(const Hypothesis& hypothesis, const Object& object, double rate,
                      const Sight& sight, const Projector& from, const FrameContext& frame) {
  HypothesisLook h;
  h.box = projectObserved(hypothesis.x, from, frame.styleOf(hypothesis.class_name),
                          hypothesis.facing());
  h.late_looks =
      sharedLooks(hypothesis.x.head<3>(), object.late_view, frame.view, frame.parameters->looks);
  if (!h.box) return h;
  h.covariance = predictedCovariance(hypothesis, *h.box, frame.pose_error.covariance);
  const double size =
      std::sqrt((h.box->sides[2] - h.box->sides[0]) * (h.box->sides[3] - h.box->sides[1]));
  const double v = sight.fraction * (1.0 - object.screened);
  h.expected = sight.fraction * shareFound(object, frame.parameters->visibility.elusive_found) *
               foundAs(hypothesis, object, size, frame);
  h.detection = std::min(h.expected * rate, kMostFound * v);
  h.missed = v - h.detection;
  h.silent = 1.0 - h.detection;
  return h;
}

/// Where boxes lie that mayOverlap may be true of, for one of the hypotheses: to see that a box
/// lies elsewhere is most of the work.
struct Reach {
  double least[2], most[2];

  /// True where in doubt.
  bool touches(const BoxMeasurement& z) const {
    for (int axis = 0; axis < 2; ++axis) {
      if (z.sides[axis] > most[axis] || z.sides[axis + 2] < least[axis]) return false;
    }
    return true;
  }
};

Reach reachOf(const std::vector<HypothesisLook>& hypotheses, const std::vector<Evidence>& boxes) {
  constexpr double kFar = 1e30, kReach = 5.01;  // a little more than mayOverlap's deviations
  double noise[2] = {0.0, 0.0};
  for (const Evidence& e : boxes) {
    for (int axis = 0; axis < 2; ++axis) noise[axis] = std::max(noise[axis], e.z.variance[axis]);
  }
  Reach reach{{kFar, kFar}, {-kFar, -kFar}};
  for (const HypothesisLook& h : hypotheses) {
    if (!h.box) continue;
    for (int axis = 0; axis < 2; ++axis) {
      const double variance = std::max(h.covariance(axis, axis), h.covariance(axis + 2, axis + 2));
      const double far = kReach * std::sqrt(std::max(variance + noise[axis], 0.0));
      const double least = h.box->sides[axis] - far, most = h.box->sides[axis + 2] + far;
      if (!std::isfinite(least + most)) return {{-kFar, -kFar}, {kFar, kFar}};
      reach.least[axis] = std::min(reach.least[axis], least);
      reach.most[axis] = std::max(reach.most[axis], most);
    }
  }
  return reach;
}

}  // namespace

double logClutterOf(const Evidence& e, const BoxScore& score, const View& view,
                    const ClutterParameters& parameters) {
  const auto& ignored = score.ignored;
  if (std::none_of(ignored.begin(), ignored.end(), [](bool i) { return i; })) {
    return e.log_clutter + e.log_remnants;
  }
  return e.log_remnants +
         logClutter(e.z, view.camera->width(), view.camera->height(), parameters, ignored);
}

ObjectLook look(const Object& object, const Sight& sight, const std::vector<Evidence>& boxes,
                const FrameContext& frame) {
  ObjectLook result;
  result.sight = sight;
  result.hypotheses.reserve(object.hypotheses.size());
  const Projector from = frame.projector();
  const double rate = rateOf(object, frame);
  for (const auto& hypothesis : object.hypotheses) {
    result.hypotheses.push_back(lookAt(hypothesis, object, rate, sight, from, frame));
  }
  const Reach reach = reachOf(result.hypotheses, boxes);
  for (std::size_t z = 0; z < boxes.size(); ++z) {
    if (!reach.touches(boxes[z].z)) continue;
    const bool near = std::any_of(result.hypotheses.begin(), result.hypotheses.end(),
                                  [&](const HypothesisLook& h) {
                                    return h.box && mayOverlap(boxes[z].z, *h.box, h.covariance);
                                  });
    if (near) result.boxes.push_back(z);
  }
  for (std::size_t i = 0; i < result.hypotheses.size(); ++i) {
    HypothesisLook& h = result.hypotheses[i];
    h.fits.assign(result.boxes.size(), {});
    if (h.box) scoreBoxes(h, object.hypotheses[i].class_name, object.alike, result, boxes, frame);
  }
  return result;
}

std::array<bool, 4> hiddenSides(const ObjectLook& look, std::size_t box) {
  std::array<bool, 4> hidden = look.sight.hidden;
  const auto at = std::find(look.boxes.begin(), look.boxes.end(), box) - look.boxes.begin();
  const auto i = static_cast<std::size_t>(at);
  if (i == look.boxes.size()) return hidden;
  const auto best = std::max_element(
      look.hypotheses.begin(), look.hypotheses.end(),
      [i](const auto& a, const auto& b) { return a.fits[i].likelihood < b.fits[i].likelihood; });
  const int part = best->fits[i].part;
  if (part >= 0) hidden[static_cast<std::size_t>(part)] = true;
  return hidden;
}

double associationWeight(const Object& object, const ObjectLook& look, std::size_t box) {
  double made = 0.0, silent = 0.0;
  for (std::size_t i = 0; i < object.hypotheses.size(); ++i) {
    const HypothesisLook& h = look.hypotheses[i];
    made += object.hypotheses[i].weight * h.detection * h.fits[box].likelihood;
    silent += object.hypotheses[i].weight * h.silent;
  }
  const double r = object.existence;
  return r * made / std::max(1.0 - r + r * silent, 1e-12);
}

}  // namespace perdure::semantic_filter
