#include "services/inference/core/suppress.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace perdure::inference {
namespace {

void merge(const Candidate& from, Candidate& into) {
  into.score = std::max(into.score, from.score);
  for (std::size_t k = 1; k < into.activations.size(); ++k) {
    into.activations[k] = std::max(into.activations[k], from.activations[k]);
  }
}

}  // namespace

double totalEvidence(const Candidate& candidate) {
  double highest = -1e300, sum = 0;
  for (std::size_t k = 1; k < candidate.activations.size(); ++k) {
    highest = std::max(highest, double{candidate.activations[k]});
  }
  for (std::size_t k = 1; k < candidate.activations.size(); ++k) {
    sum += std::exp(candidate.activations[k] - highest);
  }
  return highest + std::log(sum);
}

std::vector<Candidate> suppress(std::vector<Candidate> candidates, double iou, std::size_t limit) {
  std::vector<double> total;
  for (const Candidate& c : candidates) total.push_back(totalEvidence(c));
  std::vector<std::size_t> order(candidates.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return total[a] > total[b]; });
  std::vector<Candidate> kept;
  for (const std::size_t i : order) {
    Candidate& candidate = candidates[i];
    const auto overlapping = std::find_if(kept.begin(), kept.end(), [&](const Candidate& k) {
      return intersectionOverUnion(k.box, candidate.box) > iou;
    });
    if (overlapping != kept.end()) {
      merge(candidate, *overlapping);
    } else if (kept.size() < limit) {
      kept.push_back(std::move(candidate));
    }
  }
  return kept;
}

}  // namespace perdure::inference
