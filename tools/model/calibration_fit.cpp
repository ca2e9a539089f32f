#include "tools/model/calibration_fit.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "common/base/algorithms/median.h"

namespace perdure::tools {
namespace {

constexpr int kFolds = 5;
constexpr double kMostBias = 20.0;  // nats; limit of `bias` in model.json
constexpr std::size_t kBins = 15;
constexpr std::size_t kLeastPlaces = 40;

/// Computes p = softmax(0, β x + b); element 0 is clutter. Returns the logarithm of the normaliser.
double softMaxOf(const std::vector<double>& x, double beta, double b, std::vector<double>& p) {
  double highest = 0.0;
  p.assign(x.size() + 1, 0.0);
  for (std::size_t k = 0; k < x.size(); ++k) {
    p[k + 1] = beta * x[k] + b;
    highest = std::max(highest, p[k + 1]);
  }
  double sum = 0.0;
  for (double& value : p) sum += value = std::exp(value - highest);
  for (double& value : p) value /= sum;
  return highest + std::log(sum);
}

struct Cost {
  double value = 0.0;
  Eigen::Vector2d gradient = Eigen::Vector2d::Zero();
  Eigen::Matrix2d hessian = Eigen::Matrix2d::Zero();
};

Cost costOf(const std::vector<BoxOutcome>& boxes, const Eigen::Vector2d& theta) {
  Cost cost;
  std::vector<double> p;
  for (const BoxOutcome& box : boxes) {
    const double log_sum = softMaxOf(box.odds, theta[0], theta[1], p);
    Eigen::Vector2d mean = Eigen::Vector2d::Zero();
    Eigen::Matrix2d second = Eigen::Matrix2d::Zero();
    for (std::size_t k = 0; k < box.odds.size(); ++k) {
      const Eigen::Vector2d feature(box.odds[k], 1.0);
      mean += p[k + 1] * feature;
      second += p[k + 1] * feature * feature.transpose();
    }
    Eigen::Vector2d own = Eigen::Vector2d::Zero();
    if (box.label > 0) own = {box.odds[box.label - 1], 1.0};
    cost.value += log_sum - theta.dot(own);
    cost.gradient += mean - own;
    cost.hessian += second - mean * mean.transpose();
  }
  return cost;
}

/// Minimises the cost by Newton's method with step halving. If `with_bias` is false, b stays 0.
Eigen::Vector2d minimise(const std::vector<BoxOutcome>& boxes, bool with_bias) {
  Eigen::Vector2d theta(1.0, 0.0);
  Cost cost = costOf(boxes, theta);
  for (int i = 0; i < 50; ++i) {
    Eigen::Vector2d step = Eigen::Vector2d::Zero();
    Eigen::Matrix2d H = cost.hessian + 1e-9 * Eigen::Matrix2d::Identity();
    if (with_bias) {
      step = -H.ldlt().solve(cost.gradient);
    } else {
      step[0] = -cost.gradient[0] / H(0, 0);
    }
    bool better = false;
    for (int half = 0; half < 30 && !better; ++half, step *= 0.5) {
      Eigen::Vector2d next = theta + step;
      next[0] = std::clamp(next[0], 0.05, 20.0);
      next[1] = std::clamp(next[1], -kMostBias, kMostBias);
      const Cost there = costOf(boxes, next);
      if (!(there.value < cost.value)) continue;
      better = true;
      theta = next;
      cost = there;
    }
    if (!better || step.norm() < 1e-8) break;
  }
  return theta;
}

bool bothKinds(const std::vector<BoxOutcome>& boxes) {
  const auto clutter = [](const BoxOutcome& b) { return b.label == 0; };
  return std::ranges::any_of(boxes, clutter) && !std::ranges::all_of(boxes, clutter);
}

}  // namespace

Softening fitSoftening(const std::vector<BoxOutcome>& boxes) {
  if (!bothKinds(boxes)) return {};
  const Eigen::Vector2d plain = minimise(boxes, false), full = minimise(boxes, true);
  const double gain = 2.0 * (costOf(boxes, plain).value - costOf(boxes, full).value);
  const bool pays = gain > std::log(static_cast<double>(boxes.size()));
  const Eigen::Vector2d& theta = pays ? full : plain;
  return {1.0 / theta[0], theta[1]};
}

Reliability reliabilityOf(const std::vector<BoxOutcome>& boxes,
                          const std::vector<Softening>& calibrations) {
  Reliability result;
  result.bins.resize(kBins);
  result.boxes = boxes.size();
  std::vector<double> p;
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    const Softening& s = calibrations[i];
    softMaxOf(boxes[i].odds, 1.0 / s.temperature, s.bias, p);
    const auto best =
        static_cast<std::size_t>(std::max_element(p.begin() + 1, p.end()) - p.begin());
    const auto bin = std::min(static_cast<std::size_t>(p[best] * kBins), kBins - 1);
    result.bins[bin].confidence += p[best];
    result.bins[bin].right += boxes[i].label == best ? 1.0 : 0.0;
    ++result.bins[bin].count;
    result.likelihood -= std::log(std::max(p[boxes[i].label], 1e-12));
  }
  for (auto& bin : result.bins) {
    if (bin.count == 0) continue;
    result.error += std::abs(bin.confidence - bin.right) / static_cast<double>(boxes.size());
    bin.confidence /= static_cast<double>(bin.count);
    bin.right /= static_cast<double>(bin.count);
  }
  if (!boxes.empty()) result.likelihood /= static_cast<double>(boxes.size());
  return result;
}

std::vector<Softening> crossValidated(const std::vector<BoxOutcome>& boxes, std::size_t frames) {
  const auto foldOf = [&](const BoxOutcome& b) {
    return b.frame * kFolds / std::max<std::size_t>(frames, 1);
  };
  std::vector<Softening> folds;
  for (std::size_t fold = 0; fold < kFolds; ++fold) {
    std::vector<BoxOutcome> others;
    std::ranges::copy_if(boxes, std::back_inserter(others),
                         [&](const BoxOutcome& b) { return foldOf(b) != fold; });
    folds.push_back(fitSoftening(others));
  }
  std::vector<Softening> result;
  for (const BoxOutcome& box : boxes)
    result.push_back(folds[std::min<std::size_t>(foldOf(box), kFolds - 1)]);
  return result;
}

double clutterRateOf(const std::vector<BoxOutcome>& boxes) {
  if (boxes.empty()) return 0.5;
  const auto clutter = std::ranges::count(boxes, 0, &BoxOutcome::label);
  return std::clamp(static_cast<double>(clutter) / static_cast<double>(boxes.size()), 0.01, 0.99);
}

std::optional<inference::PrimedCalibration> fitPrimed(const std::vector<PrimedOutcome>& places,
                                                      double floor) {
  std::vector<BoxOutcome> found;  // logistic regression is this fit with one class
  double there = 0, nothing_there = 0, elsewhere = 0, nothing_elsewhere = 0;
  for (const PrimedOutcome& place : places) {
    (place.there ? there : elsewhere) += 1;
    if (place.odds) {
      found.push_back({0, {*place.odds}, place.there ? 1U : 0U});
    } else {
      (place.there ? nothing_there : nothing_elsewhere) += 1;
    }
  }
  if (std::min(there, elsewhere) < kLeastPlaces || !bothKinds(found)) return std::nullopt;
  const Eigen::Vector2d theta = minimise(found, true);
  inference::PrimedCalibration primed;
  primed.floor = floor;
  primed.slope = std::clamp(theta[0], 0.0, 10.0);
  primed.offset = std::clamp(theta[1] - std::log(there / elsewhere), -20.0, 20.0);
  primed.nothing = std::clamp(std::log((nothing_there + 0.5) / (there + 1.0)) -
                                  std::log((nothing_elsewhere + 0.5) / (elsewhere + 1.0)),
                              -20.0, 0.0);
  return primed;
}

double robustSigma(std::vector<double> values) {
  for (double& value : values) value = std::abs(value);
  return 1.4826 * medianOf(std::move(values));
}

}  // namespace perdure::tools
