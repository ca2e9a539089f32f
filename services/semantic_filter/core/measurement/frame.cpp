#include "services/semantic_filter/core/measurement/frame.h"

#include <cmath>

namespace perdure::semantic_filter {

namespace {

constexpr double kNever = 1e9;  // a scale that makes a view change count nothing

}  // namespace

Projector FrameContext::projector() const { return frame_view ? frame_view->projector : view; }

ViewScales biasScales(const BoxParameters& box) {
  return {box.bias_angle, box.bias_log_distance, box.bias_image_angle};
}

ViewScales detectabilityScales(const VisibilityParameters& visibility) {
  return {visibility.detectability_angle, visibility.detectability_log_distance, kNever};
}

ViewWalk viewWalkOf(const FrameContext& frame) {
  const BoxParameters& box = frame.parameters->box;
  const VisibilityParameters& visibility = frame.parameters->visibility;
  ViewWalk walk;
  walk.T_WC = frame.view.T_WC();
  walk.focal = frame.view.camera->fx();
  const BoxNoise noise =
      frame.model ? boxNoise(*frame.model, frame.view.camera->width()) : BoxNoise{};
  walk.lasting = lastingError(box, noise) * std::sqrt(frame.noise_scale.lasting());
  walk.bias = biasScales(box);
  walk.unmapped_occluder = visibility.unmapped_occluder;
  walk.hard_to_detect = visibility.hard_to_detect;
  walk.detectability = detectabilityScales(visibility);
  return walk;
}

}  // namespace perdure::semantic_filter
