#include "services/semantic_filter/core/belief/learned.h"

#include <algorithm>
#include <cmath>

#include "services/semantic_filter/core/belief/motion_model.h"

namespace perdure::semantic_filter {

namespace {

/// Returns the value of a network in the list, and adds it if it is missing.
template <class T>
T& entryOf(std::vector<std::pair<std::uint64_t, T>>& list, std::uint64_t model) {
  const auto it = std::find_if(list.begin(), list.end(),
                               [model](const auto& entry) { return entry.first == model; });
  return it == list.end() ? list.emplace_back(model, T()).second : it->second;
}

}  // namespace

constexpr double kLeastRatio = 0.04, kMostRatio = 9.0;

SideScales SideVariances::scales(std::uint64_t model) const {
  for (const auto& [of, estimate] : estimates_) {
    if (of == model) return {std::exp(estimate.logs[0]), std::exp(estimate.logs[1])};
  }
  return {};
}

void SideVariances::learn(std::uint64_t model, const SideEvidence& evidence, double assumed) {
  // A network has other errors on another road, so older residuals lose weight.
  constexpr double kRemembered = 4000.0;  // sides
  // The lasting error differs more between networks than their noise does. So its assumed value
  // has a smaller weight than the assumed noise.
  constexpr double kLastingWeight = 0.1;
  if (assumed <= 0.0 || !evidence.gradient.allFinite() || !(evidence.information.trace() > 0.0)) {
    return;
  }
  Estimate& e = entryOf(estimates_, model);
  e.information += evidence.information;
  Eigen::Matrix2d information = e.information;
  information(0, 0) += assumed;
  information(1, 1) += kLastingWeight * assumed;
  const Eigen::Vector2d next = e.logs + information.inverse() * evidence.gradient;
  e.logs = next.cwiseMax(std::log(kLeastRatio)).cwiseMin(std::log(kMostRatio));
  if (e.information(0, 0) > kRemembered) e.information *= kRemembered / e.information(0, 0);
}

double NoiseScales::ratio(std::uint64_t model, double assumed) const {
  if (assumed <= 0.0) return 1.0;
  for (const auto& [of, heard] : sums_) {
    if (of != model) continue;
    const double ratio = (assumed + heard.squares) / (assumed + heard.count);
    return std::clamp(ratio, kLeastRatio, kMostRatio);
  }
  return 1.0;
}

void NoiseScales::learn(std::uint64_t model, const ResidualRatio& over) {
  if (!std::isfinite(over.ratio) || !(over.count > 0.0)) return;
  Sums& heard = entryOf(sums_, model);
  heard.squares += over.count * std::min(over.ratio, kMostRatio);
  heard.count += over.count;
  if (heard.count <= remembered_) return;
  heard.squares *= remembered_ / heard.count;
  heard.count = remembered_;
}

BoxExtents::Odds BoxExtents::of(std::uint64_t model) const {
  for (const auto& [of, odds] : odds_) {
    if (of == model) return odds;
  }
  return {};
}

bool BoxExtents::decided(std::uint64_t model) const {
  constexpr double kEnough = 30.0;  // nats
  return std::abs(of(model).nats) > kEnough;
}

void BoxExtents::learn(std::uint64_t model, double nats) {
  // Each change moves all objects. The threshold prevents repeated changes near zero.
  constexpr double kClear = 6.0;  // nats
  Odds& odds = entryOf(odds_, model);
  odds.nats += nats;
  if (std::abs(odds.nats) > kClear) odds.outlines = odds.nats > 0.0;
}

double DetectionSizes::scale(std::uint64_t model) const {
  for (const auto& [of, estimate] : estimates_) {
    if (of == model) return std::exp(estimate.log);
  }
  return 1.0;
}

void DetectionSizes::learn(std::uint64_t model, const SizeEvidence& evidence) {
  constexpr double kAssumed = 4.0;       // a standard deviation of .5: a factor of 1.6
  constexpr double kRemembered = 400.0;  // other roads have other occluders of far objects
  constexpr double kMost = 1.8;          // a factor of 6
  if (!(evidence.information > 0.0) || !std::isfinite(evidence.gradient)) return;
  Estimate& e = entryOf(estimates_, model);
  e.information = std::min(e.information + evidence.information, kRemembered);
  e.log = std::clamp(e.log + evidence.gradient / (kAssumed + e.information), -kMost, kMost);
}

void MoverShares::learn(const Track& track, double min_speed) {
  constexpr std::uint32_t kJudgedAt =
      20;  // detections; after 10, one in eight parked cars of KITTI 00 seems to move
  if (track.life.hits != kJudgedAt || !track.life.once_confirmed) return;
  auto counts = counts_ ? *counts_ : std::map<std::string, Counts>();
  Counts& of_class = counts[track.best().class_name];
  of_class.moving += movingProbability(track, min_speed);
  of_class.all += 1.0;
  counts_ = std::make_shared<const std::map<std::string, Counts>>(std::move(counts));
}

double MoverShares::of(const ClassPrior& prior) const {
  // Streets in which all cars stand and streets in which all move are both frequent.
  constexpr double kPriorObjects = 1.0;
  if (!counts_ || prior.moving <= 0.0) return prior.moving;
  const auto found = counts_->find(prior.name);
  if (found == counts_->end()) return prior.moving;
  return (kPriorObjects * prior.moving + found->second.moving) /
         (kPriorObjects + found->second.all);
}

}  // namespace perdure::semantic_filter
