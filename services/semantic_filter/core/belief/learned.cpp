#include "services/semantic_filter/core/belief/learned.h"

#include <algorithm>
#include <cmath>

#include "services/semantic_filter/core/belief/motion_model.h"

namespace perdure::semantic_filter {

constexpr double kLeastRatio = 0.04, kMostRatio = 9.0;

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
  auto it = std::find_if(sums_.begin(), sums_.end(),
                         [model](const auto& entry) { return entry.first == model; });
  if (it == sums_.end()) it = sums_.insert(sums_.end(), {model, {}});
  Sums& heard = it->second;
  heard.squares += over.count * std::min(over.ratio, kMostRatio);
  heard.count += over.count;
  if (heard.count <= remembered_) return;
  heard.squares *= remembered_ / heard.count;
  heard.count = remembered_;
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
  constexpr double kPriorObjects = 5.0;
  if (!counts_ || prior.moving <= 0.0) return prior.moving;
  const auto found = counts_->find(prior.name);
  if (found == counts_->end()) return prior.moving;
  return (kPriorObjects * prior.moving + found->second.moving) /
         (kPriorObjects + found->second.all);
}

}  // namespace perdure::semantic_filter
