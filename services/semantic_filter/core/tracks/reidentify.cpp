#include "services/semantic_filter/core/tracks/reidentify.h"

#include <algorithm>
#include <limits>

#include "services/semantic_filter/core/belief/motion_model.h"
#include "services/semantic_filter/core/smoothing/keyframes.h"
#include "services/semantic_filter/core/tracks/lifecycle.h"

namespace perdure::semantic_filter {
namespace {

constexpr double kMissing = 0.5;    // existence below which a once confirmed track is missing
constexpr double kOverlap_s = 0.5;  // both may have been detected for so long
constexpr double kDriven_s = 2.0;   // from the last detection of one to the first of the other
constexpr double kTraced_s = 3.0;   // over which a velocity shows where an object came from
constexpr double kCarried_m = 2.5;  // by which objects are carried
constexpr int kLeastKeyframes = 3;  // that had the empty place in the image
constexpr double kTooFar = std::numeric_limits<double>::infinity();

bool isMissing(const Track& o) { return o.life.once_confirmed && o.existence < kMissing; }

/// Whether most keyframes of the missing track had the place of the new one in the image, when
/// nothing was there. What is new only because the camera never saw its place was not carried
/// there.
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

/// Whether the first box of a moving track is almost the last box of the missing one, and follows
/// it at once. Then both are one object, even if the missing one was misplaced, or deformed until
/// it was of no known class.
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

/// Returns the distance, m, between the place of the missing track and where the new one was then;
/// infinite if they cannot be one object.
double distanceBetween(const Track& missing, const Track& new_track, const FrameContext& frame) {
  const Hypothesis& h = new_track.best();
  if (!confirmedOrEstablished(new_track, frame) || h.class_name == kOtherClass) return kTooFar;
  if (takesOver(new_track, missing)) return 0.0;
  if (h.class_name != missing.best().class_name) return kTooFar;
  const double since = toSeconds(new_track.life.first_seen - missing.life.last_seen);
  if (since < -kOverlap_s) return kTooFar;
  const bool carried =
      frame.priors->of(h.class_name).moving <= 0.0 && wasInView(h.x.head<3>(), missing);
  if (h.moving ? since > kDriven_s : !carried) return kTooFar;
  const double ago = toSeconds(new_track.as_of - missing.life.last_seen);
  if (h.moving && ago > kTraced_s) return kTooFar;
  const State then = stateAt(h, -ago);
  const double metres = (then - missing.best().x).head<3>().norm();
  // A belief at rest follows an object that drives off for a while.
  const double length = h.x.segment<3>(kSize).array().exp().maxCoeff();
  return metres < (h.moving ? 0.75 * length : kCarried_m) ? metres : kTooFar;
}

std::size_t nearest(const std::vector<Track>& tracks, std::size_t of, bool among_missing,
                    const FrameContext& frame) {
  std::size_t best = tracks.size();
  double least = kTooFar;
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    if (i == of || isMissing(tracks[i]) != among_missing) continue;
    const double d = among_missing ? distanceBetween(tracks[i], tracks[of], frame)
                                   : distanceBetween(tracks[of], tracks[i], frame);
    if (d < least) least = d, best = i;
  }
  return best;
}

/// The new track keeps its belief and takes over the id, the first times and the counts of the old
/// one.
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

std::vector<MergeRecord> reidentifyMoved(std::vector<Track>& tracks, const FrameContext& frame) {
  std::vector<MergeRecord> merges;
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    if (!isMissing(tracks[i])) continue;
    const std::size_t j = nearest(tracks, i, false, frame);
    if (j == tracks.size() || nearest(tracks, j, true, frame) != i) continue;
    merges.push_back({tracks[i].id, tracks[j].id, true, false});
    takeOverIdentity(tracks[i], std::move(tracks[j]));
    tracks.erase(tracks.begin() + static_cast<std::ptrdiff_t>(j));
    if (j < i) --i;
  }
  return merges;
}

void keepDeleted(std::vector<Track>& recently_deleted, std::vector<Track> deleted, TimePoint now,
                 const TrackParameters& parameters) {
  std::erase_if(recently_deleted,
                [&](const Track& o) { return toSeconds(now - o.as_of) > parameters.reidentify_s; });
  for (Track& o : deleted) {
    const Hypothesis& best = o.best();
    if (!o.life.once_confirmed || best.moving || best.class_name == kOtherClass) continue;
    o.visibility.fraction = 0.0;
    recently_deleted.push_back(std::move(o));
  }
}

std::vector<MergeRecord> reidentifyDeleted(std::vector<Track>& tracks,
                                           std::vector<Track>& recently_deleted,
                                           const FrameContext& frame) {
  std::vector<MergeRecord> merges;
  for (Track& o : tracks) {
    if (recently_deleted.empty()) break;
    if (!confirmedOrEstablished(o, frame) || o.visibility.fraction <= 0.0) continue;
    const bool moves = o.best().moving;
    std::size_t match = recently_deleted.size();
    double most = frame.parameters->tracks.merge_overlap;
    for (std::size_t i = 0; i < recently_deleted.size(); ++i) {
      const Track& past = recently_deleted[i];
      if (o.life.first_seen <= past.life.last_seen) continue;
      const bool same_class = past.best().class_name == o.best().class_name;
      const double shared = moves        ? (takesOver(o, past) ? 1.0 : 0.0)
                            : same_class ? overlap(past.best().x, o.best().x, frame.view.up_W)
                                         : 0.0;
      if (shared >= most) most = shared, match = i;
    }
    if (match == recently_deleted.size()) continue;
    merges.push_back({recently_deleted[match].id, o.id, moves, !moves});
    if (moves) {
      takeOverIdentity(recently_deleted[match], std::move(o));
    } else {
      resumeTrack(recently_deleted[match], o, frame);
    }
    o = std::move(recently_deleted[match]);
    recently_deleted.erase(recently_deleted.begin() + static_cast<std::ptrdiff_t>(match));
  }
  if (merges.empty()) return merges;
  std::stable_sort(tracks.begin(), tracks.end(),
                   [](const Track& a, const Track& b) { return a.id < b.id; });
  return merges;
}

}  // namespace perdure::semantic_filter
