#include "services/semantic_filter/core/measurement/frame.h"

#include <cmath>

namespace perdure::semantic_filter {

namespace {

constexpr double kNever = 1e9;  // a change of view that never counts

}  // namespace

Projector FrameContext::projector() const { return key_view ? key_view->projector : view; }

ViewScales screenScales(const VisibilityParameters& visibility) {
  return {visibility.screen_angle, visibility.screen_log_distance, kNever};
}

ViewWalk viewWalkOf(const FrameContext& frame) {
  const BoxParameters& box = frame.parameters->box;
  const VisibilityParameters& visibility = frame.parameters->visibility;
  ViewWalk walk;
  walk.T_WC = frame.view.T_WC();
  walk.focal = frame.view.camera->fx();
  const BoxNoise noise =
      frame.model ? boxNoise(*frame.model, frame.view.camera->width()) : BoxNoise{};
  walk.lasting = lastingError(box, noise) * std::sqrt(frame.errors.lasting());
  walk.bias = {box.bias_angle, box.bias_log_distance, box.bias_image_angle};
  walk.screened = visibility.screened;
  walk.elusive = visibility.elusive;
  walk.screen = screenScales(visibility);
  return walk;
}

}  // namespace perdure::semantic_filter
