#include "services/semantic_filter/core/tracks/lifecycle.h"

#include <algorithm>

#include "common/base/algorithms/stable_sort.h"
#include "common/math/gaussian.h"
#include "services/semantic_filter/core/belief/motion_model.h"
#include "services/semantic_filter/core/belief/pose_correlation.h"
#include "services/semantic_filter/core/tracks/merge.h"

namespace perdure::semantic_filter {

namespace {

constexpr double kWithdrawn = 1.5;  // confirmation ends at this multiple of confirm_sigma_m

/// Whether a track has few hits, was never confirmed, and has been invisible for tentative_s.
bool forgettable(const Track& o, const TrackParameters& parameters) {
  if (o.life.once_confirmed || o.life.hits > static_cast<std::uint32_t>(parameters.confirm_hits))
    return false;
  const TimePoint last = std::max(o.unused.occluded.last, o.unused.out_of_view.last);
  const bool invisible = o.unused.count() > 0;
  return invisible && toSeconds(last - o.life.last_seen) > parameters.tentative_s;
}

/// Whether the confirmation must wait, because the track may be an older confirmed one that was
/// visible in part. That one must be visible now, or hidden by this track. The wait ends if misses
/// delete the older track, if a merge joins both, or after kMost hits, because two objects may
/// overlap by the errors of their estimates. Source of the number: merge_and_fusion.md, "Waiting".
bool waits(const Track& o, const std::vector<Track>& tracks, const FrameContext& frame) {
  constexpr std::uint32_t kMost = 12;
  return o.life.hits < kMost && std::any_of(tracks.begin(), tracks.end(), [&](const Track& t) {
           return t.life.confirmed && t.id < o.id && mayBeOne(t, o, frame) &&
                  (t.visibility.fraction > 0.0 || t.visibility.blocked_by == o.id);
         });
}

}  // namespace

bool established(const Track& track, const FrameContext& frame) {
  const TrackParameters& parameters = frame.parameters->tracks;
  return track.existence >= parameters.confirm && track.life.hits >= parameters.confirm_hits &&
         placeSigma(track.best(), frame.pose_error.covariance) < parameters.confirm_sigma_m;
}

void withdrawLostMovers(std::vector<Track>& tracks, const FrameInput& frame,
                        const Parameters& parameters) {
  const TimePoint now = frame.stamp.time;
  for (auto& o : tracks) {
    if (!o.life.confirmed || o.as_of >= now) continue;
    if (movingProbability(o, parameters.motion.min_speed) <= 0.5) continue;
    const Track then = extrapolated(o, now, parameters.motion);
    const double sigma = placeSigma(then, frame.pose_error.covariance);
    if (sigma > kWithdrawn * parameters.tracks.confirm_sigma_m) o.life.confirmed = false;
  }
}

std::vector<Track> confirmAndDelete(std::vector<Track>& tracks, const FrameContext& frame) {
  const TrackParameters& parameters = frame.parameters->tracks;
  for (auto& o : tracks) {
    if (o.visibility.fraction <= 0.0) continue;
    const double sigma = placeSigma(o, frame.pose_error.covariance);
    if (o.existence < 0.5 || sigma > kWithdrawn * parameters.confirm_sigma_m) {
      o.life.confirmed = false;
      continue;
    }
    if (established(o, frame) && sigma < parameters.confirm_sigma_m &&
        (o.life.once_confirmed || !waits(o, tracks, frame))) {
      o.life.confirmed = o.life.once_confirmed = true;
    }
  }
  std::vector<Track> deleted;
  std::erase_if(tracks, [&](Track& o) {
    if (forgettable(o, parameters)) return true;
    if (o.existence >=
        (o.life.hits > 1 ? parameters.delete_below : parameters.delete_tentative_below))
      return false;
    deleted.push_back(std::move(o));
    return true;
  });
  const auto limit = static_cast<std::size_t>(parameters.max_objects);
  if (tracks.size() <= limit) return deleted;
  stableSortBy(tracks, [](const Track& o) { return -o.existence; });
  tracks.resize(limit);
  stableSortBy(tracks, [](const Track& o) { return o.id; });
  return deleted;
}

}  // namespace perdure::semantic_filter
