#include "services/semantic_filter/core/association/box_explanation.h"

#include "services/semantic_filter/core/belief/motion_model.h"

namespace perdure::semantic_filter {

BoxExplanations::BoxExplanations(const Belief& belief, const FrameInput& input,
                                 const Parameters& parameters)
    : belief_(belief),
      input_(input),
      from_(input.view),
      judge_{input.model.get(), &input.view, &parameters},
      at_(belief.tracks.size()) {}

bool BoxExplanations::matches(std::size_t j, const std::array<bool, 4>& hidden,
                              const BoxDetection& box) {
  return fit(j, hidden, box).has_value();
}

std::optional<double> BoxExplanations::fit(std::size_t j, const std::array<bool, 4>& hidden,
                                           const BoxDetection& box) {
  const Entry& e = entryOf(j);
  if (!e.predicted) return std::nullopt;
  const Track& track = belief_.tracks[j];
  const auto why =
      explain(box, *e.predicted, hidden, track.best().class_name, track.lookalike.nats, judge_);
  return why ? std::optional(why->log_ratio) : std::nullopt;
}

const BoxExplanations::Entry& BoxExplanations::entryOf(std::size_t j) {
  Entry& e = at_[j];
  if (e.known) return e;
  e.known = true;
  const Track& track = belief_.tracks[j];
  const Hypothesis& best = track.best();
  const State x = stateAt(best, toSeconds(input_.stamp.time - track.as_of));
  e.predicted =
      predictBox(best, x, from_, input_.model->styles->of(best.class_name), input_.pose_error);
  return e;
}

}  // namespace perdure::semantic_filter
