#include "services/semantic_filter/core/association/occlusion_revision.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "services/semantic_filter/core/association/box_explanation.h"

namespace perdure::semantic_filter {

namespace {

constexpr double kMisjudged = 3.0;  // nats, against that the blocker is not where it was thought

}  // namespace

void reviseOcclusion(Belief& belief, std::vector<TrackVisibility>& visibilities,
                     const FrameInput& input, const Parameters& parameters) {
  std::vector<std::size_t> hidden;
  for (std::size_t j = 0; j < visibilities.size(); ++j) {
    const bool solid = belief.tracks[j].existence >= parameters.visibility.solid;
    if (solid && visibilities[j].state == Visibility::kOccluded) hidden.push_back(j);
  }
  if (hidden.empty()) return;
  BoxExplanations expected(belief, input, parameters);
  for (const auto& e : *input.boxes) {
    std::vector<std::size_t> may_be;
    double best_hidden = -std::numeric_limits<double>::infinity();
    for (const std::size_t j : hidden) {
      const auto fit = expected.fit(j, {}, e);
      if (!fit) continue;
      may_be.push_back(j);
      best_hidden = std::max(best_hidden, *fit);
    }
    bool others = may_be.empty();
    for (std::size_t j = 0; j < visibilities.size() && !others; ++j) {
      if (visibilities[j].fraction <= 0.0) continue;
      const auto fit = expected.fit(j, visibilities[j].hidden_sides, e);
      others = fit && *fit > best_hidden - kMisjudged;
    }
    if (others) continue;
    for (const std::size_t j : may_be) {
      visibilities[j].hidden_sides = {};
      visibilities[j].fraction = parameters.visibility.minimum;
      visibilities[j].state = Visibility::kPartial;
      belief.tracks[j].visibility.state = Visibility::kPartial;
      belief.tracks[j].visibility.fraction = visibilities[j].fraction;
    }
  }
}

void explainPartialViews(const Belief& belief, const std::vector<TrackVisibility>& visibilities,
                         FrameInput& input, const Parameters& parameters,
                         const ClassPriors& priors) {
  std::vector<std::pair<std::size_t, double>> remnants;  // and how surely each is found
  for (std::size_t j = 0; j < visibilities.size(); ++j) {
    if (visibilities[j].residual_fraction <= 0.0) continue;
    const Track& o = belief.tracks[j];
    const double found = priors.of(o.best().class_name).detection_probability;
    remnants.emplace_back(j, o.existence * visibilities[j].residual_fraction * found);
  }
  if (remnants.empty()) return;
  BoxExplanations expected(belief, input, parameters);
  for (BoxDetection& box : *input.boxes) {
    double boxes = 0.0;
    for (const auto& [j, found] : remnants) {
      const auto fit = expected.fit(j, visibilities[j].hidden_sides, box);
      if (fit) boxes += found * std::exp(*fit);
    }
    box.log_partial_views = std::log1p(boxes);
  }
}

}  // namespace perdure::semantic_filter
