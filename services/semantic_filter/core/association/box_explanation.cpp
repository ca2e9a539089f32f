#include "services/semantic_filter/core/association/box_explanation.h"

#include "services/semantic_filter/core/belief/motion_model.h"

namespace perdure::semantic_filter {

BoxExplanations::BoxExplanations(const Belief& belief, const FrameInput& input,
                                 const Parameters& parameters)
    : belief_(belief),
      input_(input),
      from_(input.view),
      parameters_(parameters.box),
      clutter_(parameters.clutter),
      at_(belief.tracks.size()) {}

bool BoxExplanations::matches(std::size_t j, const std::array<bool, 4>& hidden,
                              const BoxDetection& box) {
  return fit(j, hidden, box).has_value();
}

std::optional<double> BoxExplanations::fit(std::size_t j, const std::array<bool, 4>& hidden,
                                           const BoxDetection& box) {
  const Entry& e = entryOf(j);
  if (!e.box || !mayOverlap(box.z, *e.box, e.covariance)) return std::nullopt;
  const auto score = scoreBox(box.z, *e.box, e.covariance, hidden, parameters_);
  if (!score) return std::nullopt;
  const Track& track = belief_.tracks[j];
  return score->log_density - logClutterOf(box, *score, input_.view, clutter_) +
         logRatio(box, *input_.model, track.best().class_name, track.lookalike.nats);
}

const BoxExplanations::Entry& BoxExplanations::entryOf(std::size_t j) {
  Entry& e = at_[j];
  if (e.known) return e;
  e.known = true;
  const Track& track = belief_.tracks[j];
  const Hypothesis& best = track.best();
  const State x = stateAt(best, toSeconds(input_.stamp.time - track.as_of));
  e.box = projectObserved(x, from_, input_.model->styles->of(best.class_name), best.heading());
  if (e.box) e.covariance = predictedCovariance(best, *e.box, input_.pose_error.covariance);
  return e;
}

}  // namespace perdure::semantic_filter
