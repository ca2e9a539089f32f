#include "services/semantic_filter/core/association/occlusion_revision.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "services/semantic_filter/core/association/box_explanation.h"

namespace perdure::semantic_filter {

namespace {

constexpr double kMisjudged = 3.0;  // nats, against that the blocker is not where it was thought

}  // namespace

void reveal(Belief& belief, std::vector<Sight>& sights,
                            const FrameInput& input, const Parameters& parameters) {
  std::vector<std::size_t> hidden;
  for (std::size_t j = 0; j < sights.size(); ++j) {
    const bool solid = belief.objects[j].existence >= parameters.visibility.solid;
    if (solid && sights[j].visibility == Visibility::kOccluded) hidden.push_back(j);
  }
  if (hidden.empty()) return;
  Expected expected(belief, input, parameters);
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
    for (std::size_t j = 0; j < sights.size() && !others; ++j) {
      if (sights[j].fraction <= 0.0) continue;
      const auto fit = expected.fit(j, sights[j].hidden, e);
      others = fit && *fit > best_hidden - kMisjudged;
    }
    if (others) continue;
    for (const std::size_t j : may_be) {
      sights[j].hidden = {};
      sights[j].fraction = parameters.visibility.minimum;
      sights[j].visibility = Visibility::kPartial;
      belief.objects[j].visibility = Visibility::kPartial;
      belief.objects[j].visible_fraction = sights[j].fraction;
    }
  }
}

void explainRemnants(const Belief& belief, const std::vector<Sight>& sights,
                                     FrameInput& input, const Parameters& parameters, const ClassPriors& priors) {
  std::vector<std::pair<std::size_t, double>> remnants;  // and how surely each is found
  for (std::size_t j = 0; j < sights.size(); ++j) {
    if (sights[j].remnant <= 0.0) continue;
    const Object& o = belief.objects[j];
    const double found = priors.of(o.best().class_name).detection_probability;
    remnants.emplace_back(j, o.existence * sights[j].remnant * found);
  }
  if (remnants.empty()) return;
  Expected expected(belief, input, parameters);
  for (Evidence& box : *input.boxes) {
    double boxes = 0.0;
    for (const auto& [j, found] : remnants) {
      const auto fit = expected.fit(j, sights[j].hidden, box);
      if (fit) boxes += found * std::exp(*fit);
    }
    box.log_remnants = std::log1p(boxes);
  }
}

}  // namespace perdure::semantic_filter
