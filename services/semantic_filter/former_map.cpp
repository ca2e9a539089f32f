#include "services/semantic_filter/former_map.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/math/so3.h"
#include "services/semantic_filter/core/belief/track_message.h"

namespace perdure::semantic_filter {
namespace {

constexpr double kPause_s = 0.5, kStep_m = 1.0;  // between two searches
constexpr std::size_t kMostKept = 256;
constexpr std::size_t kLastSeen = 16;  // objects that refine the alignment near the body

bool stands(const ObjectBelief& belief) { return belief.confirmed && belief.moving < 0.5; }

std::vector<PlacedThing> standing(const std::vector<Track>& objects, const ClassPriors& priors,
                                  double min_speed) {
  std::vector<PlacedThing> result;
  for (const Track& o : objects) {
    if (!o.life.confirmed || o.life.recalled) continue;
    const ObjectBelief belief = toBelief(o, priors, min_speed);
    if (stands(belief)) result.push_back(placedOf(belief));
  }
  return result;
}

}  // namespace

void FormerMap::keep(const WorldId& world, const std::vector<ObjectBelief>& objects) {
  std::vector<ObjectBelief> kept;
  std::copy_if(objects.begin(), objects.end(), std::back_inserter(kept), stands);
  std::stable_sort(kept.begin(), kept.end(), [](const ObjectBelief& a, const ObjectBelief& b) {
    return a.last_seen > b.last_seen;
  });
  if (kept.size() > kMostKept) kept.resize(kMostKept);
  if (kept.empty() || (lookout_ && kept.size() < lookout_->size())) return;
  world_ = world;
  kept_ = std::move(kept);
  std::vector<PlacedThing> things;
  for (const ObjectBelief& belief : kept_) things.push_back(placedOf(belief));
  lookout_.emplace(std::move(things), parameters_.alignment);
  alignment_.reset();
  laid_.clear();
  questions_.clear();
  looked_from_.reset();
}

std::string FormerMap::note() const {
  if (!lookout_) return "";
  return fmt::format("looks for {} things of the map of before", lookout_->size());
}

const FrameAlignment* FormerMap::look(const std::vector<Track>& objects,
                                      const Eigen::Vector3d& p_WB, TimePoint now) {
  if (!lookout_) return nullptr;
  if (looked_from_ && toSeconds(now - looked_at_) < kPause_s) return nullptr;
  const auto seen = standing(objects, priors_, parameters_.motion.min_speed);
  const bool changed =
      !looked_from_ || seen.size() != looked_with_ || (p_WB - *looked_from_).norm() > kStep_m;
  if (!changed || seen.size() < static_cast<std::size_t>(parameters_.alignment.pairs)) {
    return nullptr;
  }
  looked_from_ = p_WB;
  looked_at_ = now;
  looked_with_ = seen.size();
  alignment_ = lookout_->align(seen);
  if (!alignment_) return nullptr;
  lookout_.reset();
  return &*alignment_;
}

std::vector<ObjectBelief> FormerMap::takeKept() {
  std::vector<ObjectBelief> result;
  for (const ObjectBelief& belief : kept_) result.push_back(laid(belief));
  kept_.clear();
  return result;
}

void FormerMap::refine(const std::vector<Track>& objects) {
  if (!alignment_) return;
  std::vector<std::pair<TimePoint, std::pair<PlacedThing, PlacedThing>>> seen_again;
  for (const Track& o : objects) {
    const auto there = laid_.find(o.id);
    if (there == laid_.end() || o.life.recalled || o.life.hits <= there->second.second) continue;
    const ObjectBelief belief = toBelief(o, priors_, parameters_.motion.min_speed);
    if (stands(belief)) {
      seen_again.push_back({o.life.last_seen, {there->second.first, placedOf(belief)}});
    }
  }
  std::stable_sort(seen_again.begin(), seen_again.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  if (seen_again.size() > kLastSeen) seen_again.resize(kLastSeen);
  std::vector<std::pair<PlacedThing, PlacedThing>> pairs;
  for (const auto& [when, pair] : seen_again) pairs.push_back(pair);
  *alignment_ = refined(*alignment_, pairs);
}

ObjectBelief FormerMap::laid(const ObjectBelief& belief) {
  laid_[belief.id] = {placedOf(belief), belief.hits};
  return laidInto(*alignment_, belief);
}

std::optional<Archive::Question> FormerMap::ask(const Eigen::Vector3d& p_WB, TimePoint now) {
  if (!alignment_) return std::nullopt;
  return questions_.ask(rotationAboutZ(alignment_->yaw).transpose() * (p_WB - alignment_->p), now);
}

}  // namespace perdure::semantic_filter
