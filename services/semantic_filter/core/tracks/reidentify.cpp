#include "services/semantic_filter/core/tracks/reidentify.h"

#include <algorithm>
#include <limits>

#include "services/semantic_filter/core/belief/motion_model.h"
#include "services/semantic_filter/core/smoothing/keyframes.h"
#include "services/semantic_filter/core/tracks/lifecycle.h"

namespace perdure::semantic_filter {
namespace {

constexpr double kMissing = 0.5;    // existence of what was claimed
constexpr double kOverlap_s = 0.5;  // both may have been seen for so long
constexpr double kDriven_s = 2.0;   // and for so long nobody knows it
constexpr double kTraced_s = 3.0;   // for which a speed tells where something came from
constexpr double kCarried_m = 2.5;  // by which things are carried without leaving
constexpr int kLeastKeyframes = 3;  // at the empty place
constexpr double kTooFar = std::numeric_limits<double>::infinity();

bool isMissing(const Track& o) { return o.life.once_confirmed && o.existence < kMissing; }

/// Whether most keyframes that showed the one had the other's place in the picture, and nothing was
/// there: what is new only because nobody looked there before has not moved.
bool wasLookedAt(const Eigen::Vector3d& place, const Track& missing) {
  const auto& keyframes = missing.batch.keyframes;
  const auto count = std::count_if(keyframes.begin(), keyframes.end(), [&](const auto& k) {
    const CameraModel& camera = k->from->camera;
    const auto pixel = camera.project(k->from->T_WC.inverse() * place);
    return pixel && camera.inImage(*pixel);
  });
  return count >= kLeastKeyframes && 2 * count >= static_cast<std::ptrdiff_t>(keyframes.size());
}

bool isThere(const Track& o, const FrameContext& frame) {
  return o.life.confirmed || established(o, frame);
}

/// The one was seen in a box, and from then on the other in almost the same: they are one thing,
/// though it was not believed to be where it was, or, bent to what no car is, not what it was.
bool takesOver(const Track& found, const Track& missing) {
  constexpr double kAtOnce_s = 0.5, kAlike = 0.5;
  if (!found.best().moving || !found.history.first_box || !missing.history.last_box) return false;
  const std::string& was = missing.best().class_name;
  if (was != found.best().class_name && was != kOtherClass) return false;
  const double since = toSeconds(found.history.first_box->time - missing.history.last_box->time);
  return since > 0.0 && since <= kAtOnce_s &&
         intersectionOverUnion(found.history.first_box->box, missing.history.last_box->box) >
             kAlike;
}

/// Metres between where the one stood and where the other must have been then; infinite where they
/// cannot be one.
double apart(const Track& missing, const Track& found, const FrameContext& frame) {
  const Hypothesis& h = found.best();
  if (!isThere(found, frame) || h.class_name == kOtherClass) return kTooFar;
  if (takesOver(found, missing)) return 0.0;
  if (h.class_name != missing.best().class_name) return kTooFar;
  const double since = toSeconds(found.life.first_seen - missing.life.last_seen);
  if (since < -kOverlap_s) return kTooFar;
  const bool carried =
      frame.priors->of(h.class_name).moving <= 0.0 && wasLookedAt(h.x.head<3>(), missing);
  if (h.moving ? since > kDriven_s : !carried) return kTooFar;
  const double ago = toSeconds(found.as_of - missing.life.last_seen);
  if (h.moving && ago > kTraced_s) return kTooFar;
  const State then = stateAt(h, -ago);
  const double metres = (then - missing.best().x).head<3>().norm();
  // A belief at rest follows what drives off a little before it loses it.
  const double length = h.x.segment<3>(kSize).array().exp().maxCoeff();
  return metres < (h.moving ? 0.75 * length : kCarried_m) ? metres : kTooFar;
}

std::size_t nearest(const std::vector<Track>& tracks, std::size_t of, bool among_missing,
                    const FrameContext& frame) {
  std::size_t best = tracks.size();
  double least = kTooFar;
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    if (i == of || isMissing(tracks[i]) != among_missing) continue;
    const double d =
        among_missing ? apart(tracks[i], tracks[of], frame) : apart(tracks[of], tracks[i], frame);
    if (d < least) least = d, best = i;
  }
  return best;
}

/// What is known of the thing is what the newcomer shows.
void takeOverIdentity(Track& past, Track&& now) {
  now.id = past.id;
  now.life.first_seen = past.life.first_seen;
  now.history.first_box = past.history.first_box;
  now.life.hits += past.life.hits;
  now.life.visible_misses += past.life.visible_misses;
  now.life.once_confirmed = true;
  past = std::move(now);
}

/// What was known of it stays; how it is seen now is what the newcomer shows.
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

void keepDeleted(std::vector<Track>& gone, std::vector<Track> deleted, TimePoint now,
                 const TrackParameters& parameters) {
  std::erase_if(gone,
                [&](const Track& o) { return toSeconds(now - o.as_of) > parameters.reidentify_s; });
  for (Track& o : deleted) {
    const Hypothesis& best = o.best();
    if (!o.life.once_confirmed || best.moving || best.class_name == kOtherClass) continue;
    o.visibility.fraction = 0.0;
    gone.push_back(std::move(o));
  }
}

std::vector<MergeRecord> reidentifyDeleted(std::vector<Track>& tracks, std::vector<Track>& gone,
                                           const FrameContext& frame) {
  std::vector<MergeRecord> merges;
  for (Track& o : tracks) {
    if (gone.empty()) break;
    if (!isThere(o, frame) || o.visibility.fraction <= 0.0) continue;
    const bool drives = o.best().moving;
    std::size_t found = gone.size();
    double most = frame.parameters->tracks.merge_overlap;
    for (std::size_t i = 0; i < gone.size(); ++i) {
      const Track& past = gone[i];
      if (o.life.first_seen <= past.life.last_seen) continue;
      const bool lookalike_nats = past.best().class_name == o.best().class_name;
      const double shared = drives           ? (takesOver(o, past) ? 1.0 : 0.0)
                            : lookalike_nats ? overlap(past.best().x, o.best().x, frame.view.up_W)
                                             : 0.0;
      if (shared >= most) most = shared, found = i;
    }
    if (found == gone.size()) continue;
    merges.push_back({gone[found].id, o.id, drives, !drives});
    if (drives) {
      takeOverIdentity(gone[found], std::move(o));
    } else {
      resumeTrack(gone[found], o, frame);
    }
    o = std::move(gone[found]);
    gone.erase(gone.begin() + static_cast<std::ptrdiff_t>(found));
  }
  if (merges.empty()) return merges;
  std::stable_sort(tracks.begin(), tracks.end(),
                   [](const Track& a, const Track& b) { return a.id < b.id; });
  return merges;
}

}  // namespace perdure::semantic_filter
