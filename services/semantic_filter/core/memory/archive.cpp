#include "services/semantic_filter/core/memory/archive.h"

#include <utility>

#include "services/semantic_filter/core/belief/motion_model.h"

namespace perdure::semantic_filter {
namespace {

constexpr double kPatience_s = 1.0;  // wait for an answer
constexpr double kAgain_s = 0.5;     // between two questions whether waiting tracks are on disk
constexpr double kStepShare = 1.0 / 3.0;        // of the margin: distance between two questions
constexpr std::size_t kMostReferences = 20000;  // about 8 MB

/// The map has it, or will have it with the next commit. A track that is not confirmed now because
/// its place relative to the body is too uncertain is still worth keeping as the map has it.
bool onTheMap(const Track& track) {
  return track.life.confirmed || (track.life.once_confirmed && track.existence >= 0.5);
}

bool mayMove(const Track& track, double min_speed) {
  return movingProbability(track, min_speed) > 0.5;
}

/// Half of the largest side: a track is near when any part of it is near.
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
  std::map<ObjectId, TimePoint> waiting;
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

bool Archive::due(const Eigen::Vector3d& p_WB, TimePoint now) const {
  if (!asked_at_) return true;
  const double since_s = toSeconds(now - *asked_at_);
  if (open_) return since_s > kPatience_s || since_s < 0.0;
  if (!known_around_) return true;
  if ((p_WB - *known_around_).norm() > kStepShare * parameters_.margin_m) return true;
  return !waiting_.empty() && since_s > kAgain_s;
}

std::optional<Archive::Question> Archive::ask(const Eigen::Vector3d& p_WB, TimePoint now) {
  if (!parameters_.archive || !due(p_WB, now)) return std::nullopt;
  asked_at_ = now;
  if (open_) {
    ++unanswered_;
    return open_;
  }
  // Also asks for what comes near before the next question is answered.
  open_ = {++requests_, p_WB, parameters_.recall_m + kStepShare * parameters_.margin_m};
  return open_;
}

bool Archive::answered(std::uint64_t request, TimePoint kept, bool truncated) {
  if (!open_ || open_->request != request) return false;
  kept_ = std::max(kept_, kept);
  if (truncated) {
    known_around_.reset();  // the rest comes with the next answer
  } else {
    known_around_ = open_->centre_W;
  }
  open_.reset();
  return true;
}

bool Archive::near(const Eigen::Vector3d& p_WO, const Eigen::Vector3d& p_WB) const {
  return (p_WO - p_WB).norm() <= parameters_.recall_m + parameters_.margin_m;
}

void Archive::rememberReference(const Track& track) {
  references_[track.as_of] = track.pose.product;
  if (references_.size() > kMostReferences) references_.erase(references_.begin());
}

std::optional<Matrix6d> Archive::referenceAt(TimePoint as_of) const {
  const auto found = references_.find(as_of);
  if (found == references_.end()) return std::nullopt;
  return found->second;
}

void Archive::clear() {
  waiting_.clear();
  open_.reset();
  asked_at_.reset();
  known_around_.reset();
  references_.clear();
  kept_ = {};
}

}  // namespace perdure::semantic_filter
