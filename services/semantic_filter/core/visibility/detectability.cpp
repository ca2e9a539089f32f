#include "services/semantic_filter/core/visibility/detectability.h"

#include <algorithm>
#include <cmath>

#include "services/semantic_filter/core/belief/view_change.h"

namespace perdure::semantic_filter {

namespace {

/// That something which stands, and is not on the map, hides it from here. When it comes back into
/// the picture, each look that is remembered from before vouches by itself for the views about its
/// own: what is not found where it was found then is gone rather than screened.
double screenedFromHere(const Object& object, const Eigen::Vector3d& place, const ViewWalk& walk) {
  double screened = walk.screened;
  for (const auto& k : object.keyframes.read()) {
    if (k->from->time >= object.came_back) break;  // they are in order of time
    screened *= 1.0 - std::exp(-viewChange(place, k->from->T_WC, walk.T_WC, walk.screen));
  }
  return screened;
}

}  // namespace

double shareFound(const Object& object, double elusive_found) {
  return 1.0 - object.screened - (1.0 - elusive_found) * object.elusive;
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
double foundAs(const Hypothesis& hypothesis, const Object& object, double size_px,
               const FrameContext& frame) {
  const double own = detectionProbability(frame.priors->of(hypothesis.class_name), size_px, frame);
  if (hypothesis.class_name != kOtherClass) return own;
  const auto named = std::find_if(object.hypotheses.begin(), object.hypotheses.end(),
                                  [](const auto& h) { return h.class_name != kOtherClass; });
  if (named == object.hypotheses.end()) return own;
  const double alike = alikeProbability(frame.parameters->clutter.other_lookalike, object.alike);
  const ClassPrior& like = frame.priors->of(named->class_name);
  return (1.0 - alike) * own + alike * detectionProbability(like, size_px, frame);
}

/// How often the object is found from here, beside P_D.
double rateOf(const Object& object, const FrameContext& frame) {
  if (object.best().moving) return 1.0;
  return object.found_rate.factor(aspectOf(object.best().x.head<3>(), frame.view.T_WC()),
                                  frame.parameters->looks.found_prior,
                                  screenScales(frame.parameters->visibility));
}

/// What may hide it from elsewhere is not known until it is seen from there.
void predictScreen(Object& object, const ViewWalk& walk) {
  const Eigen::Vector3d place = object.best().x.head<3>();
  const double keep = object.last_view
                          ? std::exp(-viewChange(place, *object.last_view, walk.T_WC, walk.screen))
                          : 0.0;
  const double here = screenedFromHere(object, place, walk);
  object.screened = here + keep * (object.screened - here);
  // What drives and is not found is lost rather than seldom found: it would take the boxes of what
  // stands where it was lost.
  object.elusive =
      object.best().moving ? 0.0 : walk.elusive + keep * (object.elusive - walk.elusive);
  object.elusive = std::min(object.elusive, 1.0 - object.screened);
}

/// A frame that does not show the object says that it is screened, too, or elusive. With A' where
/// it is neither, A is 1 where it is screened and 1 + q (A' - 1), q the share of P_D, where it is
/// elusive.
void hearFromHere(Object& object, double mean_A, double elusive_found) {
  const double open = shareFound(object, elusive_found);
  const double found = open > 0.0 ? elusive_found / open : 0.0;
  const double elusive = object.elusive * std::max(1.0 + found * (mean_A - 1.0), 0.0);
  object.screened = std::min(1.0, object.screened / mean_A);
  object.elusive = std::min(1.0 - object.screened, elusive / mean_A);
}

}  // namespace perdure::semantic_filter
