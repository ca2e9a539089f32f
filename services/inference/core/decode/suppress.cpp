#include "services/inference/core/decode/suppress.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

namespace perdure::inference {
namespace {

/// Weighted mean of a kept box and the boxes that were merged into it.
struct Vote {
  Box first;  ///< box of the kept candidate
  Box sum;
  std::array<double, 4> sigma_sum{};
  double weight = 0.0;

  void add(const Candidate& candidate, double w) {
    const Box& box = candidate.box;
    sum.x1 += w * box.x1, sum.y1 += w * box.y1, sum.x2 += w * box.x2, sum.y2 += w * box.y2;
    for (std::size_t i = 0; i < 4; ++i) sigma_sum[i] += w * candidate.side_sigma[i];
    weight += w;
  }
  /// Replaces the candidate's box by the mean. Its uncertainty is that of a single box, because all
  /// boxes come from the same pixels.
  void decide(Candidate& candidate) const {
    if (weight <= 0.0) return;
    candidate.box = {sum.x1 / weight, sum.y1 / weight, sum.x2 / weight, sum.y2 / weight};
    for (std::size_t i = 0; i < 4; ++i) candidate.side_sigma[i] = sigma_sum[i] / weight;
  }
};

/// Returns the weight of a merged box: He et al., "Bounding box regression with uncertainty" (CVPR
/// 2019), eq. 7, with the score in place of 1/σ².
double voteOf(const Candidate& candidate, double overlap) {
  constexpr double kWidth = 0.025;
  return candidate.score * std::exp(-(1.0 - overlap) * (1.0 - overlap) / kWidth);
}

/// Returns the share of `box` that `by` covers.
double covered(const Box& box, const Box& by) {
  const double width = std::min(box.x2, by.x2) - std::max(box.x1, by.x1);
  const double height = std::min(box.y2, by.y2) - std::max(box.y1, by.y1);
  const double area = box.width() * box.height();
  return width > 0.0 && height > 0.0 && area > 0.0 ? width * height / area : 0.0;
}

/// Subtracts evidence from `weaker` for the share of `better` that it covers (suppress.h).
void discount(const Candidate& better, Candidate& weaker) {
  const double share = covered(better.box, weaker.box);
  if (share <= 0.0) return;
  const double total = totalEvidence(better);
  for (std::size_t k = 1; k < weaker.activations.size(); ++k) {
    const double same = std::exp(better.activations[k] - total);
    weaker.activations[k] -= static_cast<float>(kDoubleNats * share * share * same);
  }
}

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
  std::vector<Vote> votes;
  for (const std::size_t i : order) {
    Candidate& candidate = candidates[i];
    std::size_t k = 0;
    double overlap = 0.0;
    for (; k < kept.size(); ++k) {
      overlap = intersectionOverUnion(votes[k].first, candidate.box);
      if (overlap > iou) break;
    }
    if (k < kept.size()) {
      votes[k].add(candidate, voteOf(candidate, overlap));
      merge(candidate, kept[k]);
    } else if (kept.size() < limit) {
      votes.push_back({.first = candidate.box, .sum = {}});
      votes.back().add(candidate, candidate.score);
      kept.push_back(std::move(candidate));
    }
  }
  for (std::size_t k = 0; k < kept.size(); ++k) votes[k].decide(kept[k]);
  for (std::size_t k = 0; k < kept.size(); ++k) {
    for (std::size_t better = 0; better < k; ++better) discount(kept[better], kept[k]);
  }
  return kept;
}

}  // namespace perdure::inference
