#include "services/semantic_filter/core/belief/track.h"

#include <algorithm>
#include <cmath>

namespace perdure::semantic_filter {

void Lifecycle::merge(const Lifecycle& other) {
  const bool met_on_revisit = recalled != other.recalled &&
                              std::abs(toSeconds(last_seen - other.last_seen)) > kAnotherVisit_s;
  detected_on_revisit = detected_on_revisit || other.detected_on_revisit || met_on_revisit;
  hits += other.hits;
  confirmed = confirmed || other.confirmed;
  once_confirmed = once_confirmed || other.once_confirmed;
  recalled = recalled && other.recalled;
  last_seen = std::max(last_seen, other.last_seen);
}

void DetectionHistory::merge(const DetectionHistory& other) {
  const auto &first = other.first_box, &last = other.last_box;
  if (first && (!first_box || first->time < first_box->time)) first_box = first;
  if (last && (!last_box || last->time > last_box->time)) last_box = last;
  recent_share = std::max(recent_share, other.recent_share);
  visible |= other.visible;
  detected |= other.detected;
}

void Viewpoints::merge(const Viewpoints& other) {
  detected_from.observations =
      std::max(detected_from.observations, other.detected_from.observations);
  observed_from.observations += other.observed_from.observations;
}

double existenceCeiling(const Track& track, const TrackParameters& parameters) {
  return track.life.detected_on_revisit ? parameters.certain_again : parameters.certain;
}

SizeEvidence& SizeEvidence::operator+=(const SizeEvidence& more) {
  gradient += more.gradient;
  information += more.information;
  return *this;
}

}  // namespace perdure::semantic_filter
