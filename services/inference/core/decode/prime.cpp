#include "services/inference/core/decode/prime.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "services/inference/core/decode/evidence.h"

namespace perdure::inference {
namespace {

constexpr double kMostNats = 5.0;  // ± limit of one top-down answer

struct Overlap {
  double iou = 0.0;
  std::size_t index = 0;
};

template <class Boxes>
Overlap mostOverlapping(const Box& box, const Boxes& others) {
  Overlap most;
  for (std::size_t i = 0; i < others.size(); ++i) {
    const double iou = intersectionOverUnion(box, others[i].box);
    if (iou > most.iou) most = {iou, i};
  }
  return most;
}

/// Whether each expectation (`met`) and each reported box (`used`) has a match.
struct Meetings {
  std::vector<bool> met, used;
};

Meetings meet(const std::vector<Expectation>& expected, const std::vector<Candidate>& reported) {
  std::vector<std::tuple<double, std::size_t, std::size_t>> pairs;
  for (std::size_t e = 0; e < expected.size(); ++e) {
    for (std::size_t r = 0; r < reported.size(); ++r) {
      const double iou = intersectionOverUnion(expected[e].box, reported[r].box);
      if (iou >= kMet) pairs.emplace_back(-iou, e, r);
    }
  }
  std::sort(pairs.begin(), pairs.end());
  Meetings result{std::vector<bool>(expected.size()), std::vector<bool>(reported.size())};
  for (const auto& [unused, e, r] : pairs) {
    if (result.met[e] || result.used[r]) continue;
    result.met[e] = result.used[r] = true;
  }
  return result;
}

/// Returns the variances, in pixels², assumed for the sides of a network's box near an expectation.
std::array<double, 4> ownVariances(const Box& expected) {
  constexpr double kRelative = 0.07, kPixels = 1.0;
  const double x = kPixels + kRelative * expected.width();
  const double y = kPixels + kRelative * expected.height();
  return {x * x, y * y, x * x, y * y};
}

std::array<double, 4> sidesOf(const Box& b) { return {b.x1, b.y1, b.x2, b.y2}; }

/// Returns the squared distance of the sides, relative to the sum of both boxes' variances.
double distance2(const Box& box, const Expectation& expectation) {
  const auto own = ownVariances(expectation.box), a = sidesOf(box), b = sidesOf(expectation.box);
  double sum = 0.0;
  for (std::size_t i = 0; i < 4; ++i) {
    const double sigma = expectation.side_sigma[i];
    sum += (a[i] - b[i]) * (a[i] - b[i]) / (own[i] + sigma * sigma);
  }
  return sum;
}

}  // namespace

std::vector<PrimedAnswer> prime(const Calibration& calibration,
                                const std::vector<Expectation>& expected,
                                const std::vector<Candidate>& reported,
                                const std::vector<Candidate>& candidates) {
  const Meetings meetings = meet(expected, reported);
  std::vector<Candidate> strangers;
  for (std::size_t r = 0; r < reported.size(); ++r) {
    if (!meetings.used[r]) strangers.push_back(reported[r]);
  }
  std::vector<PrimedAnswer> best(expected.size());
  for (std::size_t c = 0; c < candidates.size(); ++c) {
    const Candidate& candidate = candidates[c];
    const Overlap near = mostOverlapping(candidate.box, expected);
    if (near.iou < kNear || meetings.met[near.index]) continue;
    if (mostOverlapping(candidate.box, strangers).iou > near.iou) continue;
    const Expectation& expectation = expected[near.index];
    const double odds = candidate.activations[expectation.activation] -
                        logit(calibration.clutter_rate) -
                        0.5 * distance2(candidate.box, expectation);
    PrimedAnswer& winner = best[near.index];
    if (!winner.candidate || odds > winner.odds) winner = {near.index, c, odds};
  }
  std::vector<PrimedAnswer> answers;
  for (std::size_t e = 0; e < expected.size(); ++e) {
    best[e].expectation = e;
    if (!meetings.met[e]) answers.push_back(best[e]);
  }
  return answers;
}

Candidate fused(const Expectation& expectation, const Candidate& candidate) {
  const auto own = ownVariances(expectation.box);
  const auto box = sidesOf(candidate.box), predicted = sidesOf(expectation.box);
  std::array<double, 4> sides{};
  Candidate result = candidate;
  for (std::size_t i = 0; i < 4; ++i) {
    const double variance = expectation.side_sigma[i] * expectation.side_sigma[i];
    // Weight of the prediction.
    const double share = variance > 0.0 ? own[i] / (own[i] + variance) : 0.0;
    sides[i] = share * predicted[i] + (1.0 - share) * box[i];
    result.side_sigma[i] = std::sqrt((1.0 - share) * own[i]);
  }
  result.box = {sides[0], sides[1], sides[2], sides[3]};
  return result;
}

double primedLogRatio(const PrimedCalibration& primed, const PrimedAnswer& answer) {
  const double nats =
      answer.candidate ? primed.offset + primed.slope * answer.odds : primed.nothing;
  return std::clamp(nats, -kMostNats, kMostNats);
}

bool fitsFrame(const Predictions& predictions, const Frame& frame) {
  if (predictions.stamp.source != frame.stamp.source) return false;
  if (!predictions.camera.empty() && predictions.camera != frame.camera) return false;
  const double age = toSeconds(frame.stamp.time - predictions.stamp.time);
  return age >= 0.0 && age <= kPrimedHorizon_s;
}

Box movedOn(const Prediction& prediction, double after) {
  const Box& b = prediction.box;
  const auto& v = prediction.velocity;
  return {b.x1 + after * v[0], b.y1 + after * v[1], b.x2 + after * v[2], b.y2 + after * v[3]};
}

}  // namespace perdure::inference
