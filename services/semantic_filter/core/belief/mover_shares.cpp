#include "services/semantic_filter/core/belief/mover_shares.h"

#include "services/semantic_filter/core/belief/motion_model.h"

namespace perdure::semantic_filter {

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
