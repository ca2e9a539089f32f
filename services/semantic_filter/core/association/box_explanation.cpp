#include "services/semantic_filter/core/association/box_explanation.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "services/semantic_filter/core/belief/motion_model.h"

namespace perdure::semantic_filter {

BoxExplanations::BoxExplanations(const Belief& belief, const FrameInput& input,
                                 const Parameters& parameters)
    : belief_(belief),
      input_(input),
      from_(input.view),
      judge_{input.model.get(), &input.view, &parameters},
      at_(belief.tracks.size()) {}

std::optional<double> BoxExplanations::fit(std::size_t j, const std::array<bool, 4>& hidden,
                                           const BoxDetection& box) {
  const Track& track = belief_.tracks[j];
  const Hypothesis& best = track.best();
  if (!at_[j]) {
    const State x = stateAt(best, toSeconds(input_.stamp.time - track.as_of));
    at_[j] = predictBox(best, x, from_, input_.styles()->of(best.class_name), input_.pose_error);
  }
  if (!*at_[j]) return std::nullopt;
  const auto why = explain(box, **at_[j], hidden, best.class_name, track.lookalike.nats, judge_);
  return why ? std::optional(why->log_ratio) : std::nullopt;
}

// nats by which an occluded track must explain a box better than every visible one
constexpr double kMisjudged = 3.0;

void reviseOcclusion(Belief& belief, ScratchVector<TrackVisibility>& visibilities,
                     const FrameInput& input, const Parameters& parameters) {
  ScratchVector<std::size_t> hidden;
  for (std::size_t j = 0; j < visibilities.size(); ++j) {
    const bool solid = belief.tracks[j].existence >= parameters.visibility.solid;
    if (solid && visibilities[j].state == Visibility::kOccluded) hidden.push_back(j);
  }
  if (hidden.empty()) return;
  BoxExplanations expected(belief, input, parameters);
  for (const auto& e : *input.boxes) {
    ScratchVector<std::size_t> candidates;
    double best_hidden = -std::numeric_limits<double>::infinity();
    for (const std::size_t j : hidden) {
      const auto fit = expected.fit(j, {}, e);
      if (!fit) continue;
      candidates.push_back(j);
      best_hidden = std::max(best_hidden, *fit);
    }
    bool explained_by_visible = candidates.empty();
    for (std::size_t j = 0; j < visibilities.size() && !explained_by_visible; ++j) {
      if (visibilities[j].fraction <= 0.0) continue;
      const auto fit = expected.fit(j, visibilities[j].hidden_sides, e);
      explained_by_visible = fit && *fit > best_hidden - kMisjudged;
    }
    if (explained_by_visible) continue;
    for (const std::size_t j : candidates) {
      visibilities[j].hidden_sides = {};
      visibilities[j].fraction = parameters.visibility.minimum;
      visibilities[j].state = Visibility::kPartial;
      belief.tracks[j].visibility.state = Visibility::kPartial;
      belief.tracks[j].visibility.fraction = visibilities[j].fraction;
    }
  }
}

void explainPartialViews(const Belief& belief, const ScratchVector<TrackVisibility>& visibilities,
                         FrameInput& input, const Parameters& parameters,
                         const ClassPriors& priors) {
  ScratchVector<std::pair<std::size_t, double>> partial_views;  // track, expected boxes
  for (std::size_t j = 0; j < visibilities.size(); ++j) {
    if (visibilities[j].residual_fraction <= 0.0) continue;
    const Track& o = belief.tracks[j];
    const double detection_probability = priors.of(o.best().class_name).detection_probability;
    partial_views.emplace_back(
        j, o.existence * visibilities[j].residual_fraction * detection_probability);
  }
  if (partial_views.empty()) return;
  BoxExplanations expected(belief, input, parameters);
  for (BoxDetection& box : *input.boxes) {
    double ratio = 0.0;  // of the likelihood of all partial views to clutter
    for (const auto& [j, detections] : partial_views) {
      const auto fit = expected.fit(j, visibilities[j].hidden_sides, box);
      if (fit) ratio += detections * std::exp(*fit);
    }
    box.log_partial_views = std::log1p(ratio);
  }
}

}  // namespace perdure::semantic_filter
