#include "services/semantic_filter/core/tracks/reidentify.h"

#include <algorithm>
#include <optional>

#include "common/base/algorithms/stable_sort.h"
#include "common/base/scratch.h"
#include "services/semantic_filter/core/belief/motion_model.h"
#include "services/semantic_filter/core/tracks/lifecycle.h"

namespace perdure::semantic_filter {
namespace {

constexpr double kMissing = 0.5;    // existence below which a once confirmed track is missing
constexpr double kOverlap_s = 0.5;  // longest time for which both may have been detected
constexpr double kDriven_s = 2.0;   // longest time between the detections of both
constexpr double kTraced_s = 3.0;   // longest time over which a velocity gives an earlier position
constexpr double kCarried_m = 2.5;  // longest distance by which objects are carried
constexpr int kLeastKeyframes = 3;  // least number that shows that the place was empty

/// A track that was confirmed once and probably no longer exists in its place.
struct Missing {
  Track* track;
  bool deleted;
};

bool isMissing(const Track& o) { return o.life.once_confirmed && o.existence < kMissing; }

/// Whether most keyframes of the missing track show `place`, which was empty then.
bool wasInView(const Eigen::Vector3d& place, const Track& missing) {
  const auto& keyframes = missing.batch.keyframes;
  const auto count = std::count_if(keyframes.begin(), keyframes.end(), [&](const auto& k) {
    const CameraModel& camera = k->from->camera;
    const auto pixel = camera.project(k->from->T_WC.inverse() * place);
    return pixel && camera.inImage(*pixel);
  });
  return count >= kLeastKeyframes && 2 * count >= static_cast<std::ptrdiff_t>(keyframes.size());
}

bool confirmedOrEstablished(const Track& o, const FrameContext& frame) {
  return o.life.confirmed || established(o, frame);
}

/// Whether the first box of a moving track is almost the last box of the missing track, and follows
/// it at once. Both are then one object, even if the missing track was misplaced or deformed.
bool takesOver(const Track& new_track, const Track& missing) {
  constexpr double kAtOnce_s = 0.5, kSameBox = 0.5;  // kSameBox: intersection over union
  if (!new_track.best().moving || !new_track.history.first_box || !missing.history.last_box)
    return false;
  const std::string& was = missing.best().class_name;
  if (was != new_track.best().class_name && was != kOtherClass) return false;
  const double since =
      toSeconds(new_track.history.first_box->time - missing.history.last_box->time);
  return since > 0.0 && since <= kAtOnce_s &&
         intersectionOverUnion(new_track.history.first_box->box, missing.history.last_box->box) >
             kSameBox;
}

struct Match {
  double metres;  ///< from the missing track to the position of the new one at that time
  bool returned;  ///< the object is in its old place
};

std::optional<Match> matchOf(const Missing& missing, const Track& new_track,
                             const FrameContext& frame) {
  const Track& was = *missing.track;
  const Hypothesis& h = new_track.best();
  if (!confirmedOrEstablished(new_track, frame) || h.class_name == kOtherClass) return std::nullopt;
  if (takesOver(new_track, was)) return Match{0.0, false};
  if (h.class_name != was.best().class_name) return std::nullopt;
  const double since = toSeconds(new_track.life.first_seen - was.life.last_seen);
  const double ago = toSeconds(new_track.as_of - was.life.last_seen);
  const double metres = (stateAt(h, -ago) - was.best().x).head<3>().norm();
  if (missing.deleted && !h.moving && !was.best().moving && since > 0.0 &&
      new_track.visibility.fraction > 0.0 &&
      overlap(was.best().x, h.x, frame.view.up_W) >= frame.parameters->tracks.merge_overlap) {
    return Match{metres, true};
  }
  if (since < -kOverlap_s) return std::nullopt;
  const bool carried =
      frame.priors->of(h.class_name).moving <= 0.0 && wasInView(h.x.head<3>(), was);
  if (h.moving ? since > kDriven_s || ago > kTraced_s : !carried) return std::nullopt;
  // An estimate at rest follows an object that drives off for some time, so a distance is allowed.
  const double length = h.x.segment<3>(kSize).array().exp().maxCoeff();
  if (metres >= (h.moving ? 0.75 * length : kCarried_m)) return std::nullopt;
  return Match{metres, false};
}

/// Replaces the old track by the new one, with the id, first times and counts of the old one.
void takeOverIdentity(Track& past, Track&& now) {
  now.id = past.id;
  now.life.first_seen = past.life.first_seen;
  now.history.first_box = past.history.first_box;
  now.life.hits += past.life.hits;
  now.life.visible_misses += past.life.visible_misses;
  now.life.once_confirmed = true;
  past = std::move(now);
}

/// Merges the new track into the old one. Visibility and detectability are those of the new track.
void resumeTrack(Track& past, Track& now, const FrameContext& frame) {
  mergeTwo(past, now, frame);
  past.existence_lead = now.existence_lead;
  past.views.detected_from = now.views.detected_from;
  past.views.observed_from = now.views.observed_from;
  past.detectability.unmapped_occluder = now.detectability.unmapped_occluder;
  past.detectability.hard_to_detect = now.detectability.hard_to_detect;
  past.history.existence_when_detected = now.history.existence_when_detected;
  past.visibility = now.visibility;
}

}  // namespace

void keepDeleted(std::vector<Track>& recently_deleted, std::vector<Track> deleted, TimePoint now,
                 const TrackParameters& parameters) {
  std::erase_if(recently_deleted,
                [&](const Track& o) { return toSeconds(now - o.as_of) > parameters.reidentify_s; });
  for (Track& o : deleted) {
    if (!o.life.once_confirmed) continue;
    o.visibility.fraction = 0.0;
    recently_deleted.push_back(std::move(o));
  }
}

std::vector<MergeRecord> reidentify(std::vector<Track>& tracks,
                                    std::vector<Track>& recently_deleted,
                                    const FrameContext& frame) {
  ScratchVector<Missing> missing;
  ScratchVector<Track*> fresh;
  for (Track& o : tracks) isMissing(o) ? missing.push_back({&o, false}) : fresh.push_back(&o);
  for (Track& o : recently_deleted) missing.push_back({&o, true});
  struct Pair {
    std::size_t missing, fresh;
    Match match;
  };
  ScratchVector<Pair> pairs;
  for (std::size_t i = 0; i < missing.size(); ++i) {
    for (std::size_t j = 0; j < fresh.size(); ++j) {
      if (const auto match = matchOf(missing[i], *fresh[j], frame)) pairs.push_back({i, j, *match});
    }
  }
  std::vector<MergeRecord> merges;
  const auto nearer = [](const Pair& a, const Pair& b) { return a.match.metres < b.match.metres; };
  std::stable_sort(pairs.begin(), pairs.end(), nearer);
  // In this order, each track of a pair is the nearest to the other among those that are left.
  ScratchVector<bool> found(missing.size(), false), used(fresh.size(), false);
  for (const Pair& pair : pairs) {
    Track &past = *missing[pair.missing].track, &now = *fresh[pair.fresh];
    if (found[pair.missing] || used[pair.fresh]) continue;
    found[pair.missing] = used[pair.fresh] = true;
    merges.push_back({past.id, now.id, !pair.match.returned, pair.match.returned});
    if (pair.match.returned) {
      resumeTrack(past, now, frame);
    } else {
      takeOverIdentity(past, std::move(now));
    }
    now = std::move(past);
  }
  if (merges.empty()) return merges;
  const auto given_up = [](const Track& o) { return o.hypotheses.empty(); };
  std::erase_if(tracks, given_up);
  std::erase_if(recently_deleted, given_up);
  stableSortBy(tracks, [](const Track& o) { return o.id; });
  return merges;
}

}  // namespace perdure::semantic_filter
