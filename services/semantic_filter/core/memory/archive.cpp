#include "services/semantic_filter/core/memory/archive.h"

#include <utility>

#include "services/semantic_filter/core/belief/motion_model.h"

namespace perdure::semantic_filter {
namespace {

constexpr std::size_t kMostReferences = 20000;  // about 8 MB

/// Whether the map has the track, or will have it with the next commit. It may be unconfirmed now
/// because its position relative to the body is too uncertain. Its stored row remains useful.
bool onTheMap(const Track& track) {
  return track.life.confirmed || (track.life.once_confirmed && track.existence >= 0.5);
}

bool mayMove(const Track& track, double min_speed) {
  return movingProbability(track, min_speed) > 0.5;
}

/// Returns half of the largest side, m, because a track is near if any part of it is near.
double extentOf(const Track& track) {
  return 0.5 * track.best().x.segment<3>(kSize).array().exp().maxCoeff();
}

}  // namespace

bool Archive::farAndUnseen(const Track& track, const Eigen::Vector3d& p_WB, TimePoint now,
                           TimePoint oldest) const {
  if (track.life.last_seen >= oldest ||
      toSeconds(now - track.life.last_seen) < parameters_.after_s) {
    return false;
  }
  const State x = stateAt(track.best(), toSeconds(now - track.as_of));
  return (x.head<3>() - p_WB).norm() - extentOf(track) >
         parameters_.recall_m + parameters_.margin_m;
}

Archive::Leaving Archive::leaving(const std::vector<Track>& tracks, const Eigen::Vector3d& p_WB,
                                  TimePoint now, TimePoint oldest) {
  Leaving result;
  if (!parameters_.archive) return result;
  std::map<TrackId, TimePoint> waiting;
  for (const Track& o : tracks) {
    if (!farAndUnseen(o, p_WB, now, oldest)) continue;
    if (!onTheMap(o) || mayMove(o, min_speed_)) {
      result.forgotten.push_back(o.id);
      continue;
    }
    const auto before = waiting_.find(o.id);
    const TimePoint since = before == waiting_.end() ? now : before->second;
    if (kept_ >= since) {
      result.archived.push_back(o.id);
    } else {
      waiting[o.id] = since;
    }
  }
  waiting_ = std::move(waiting);
  return result;
}

double Archive::nearRadius() const {
  constexpr double kShare =
      1.0 / 3.0;  // of the margin: objects may come near before the next message
  return parameters_.archive ? parameters_.recall_m + kShare * parameters_.margin_m : 0.0;
}

void Archive::rememberReference(const Track& track) {
  references_[track.as_of] = track.pose_product;
  if (references_.size() > kMostReferences) references_.erase(references_.begin());
}

std::optional<Matrix6d> Archive::referenceAt(TimePoint as_of) const {
  const auto found = references_.find(as_of);
  if (found == references_.end()) return std::nullopt;
  return found->second;
}

void Archive::clear() {
  waiting_.clear();
  references_.clear();
  kept_ = {};
}

}  // namespace perdure::semantic_filter
