// Archive: selects the tracks that leave the working set for the map store (the paper's semantic
// map, line 288). No track leaves before the map store reports that it is on disk. Without a map
// store, or with a slow one, the working set grows and nothing is lost.
#pragma once

#include <algorithm>
#include <map>
#include <optional>
#include <vector>

#include "services/semantic_filter/core/belief/track.h"
#include "services/semantic_filter/core/parameters.h"

namespace perdure::semantic_filter {

class Archive {
 public:
  Archive(const MemoryParameters& parameters, double min_speed)
      : parameters_(parameters), min_speed_(min_speed) {}

  struct Leaving {
    std::vector<TrackId> archived;   ///< at rest and on the map, until they are recalled
    std::vector<TrackId> forgotten;  ///< never confirmed, or moving and out of view
  };
  /// Returns the tracks that leave. Must be called after the step of a frame at `now`, with the
  /// body at p_WB. Tracks detected since `oldest` stay, because these frames may be stepped again.
  Leaving leaving(const std::vector<Track>& tracks, const Eigen::Vector3d& p_WB, TimePoint now,
                  TimePoint oldest);

  /// Must be called if the map store has all tracks on disk that were published up to `time`.
  void onKept(TimePoint time) { kept_ = std::max(kept_, time); }
  TimePoint kept() const { return kept_; }
  /// The distance from the body up to which the map gives objects, m; 0: none. Tracks leave at a
  /// greater distance, so that they do not come and go.
  double nearRadius() const;

  /// Stores the product that the cross-covariance of an archived track refers to. The map lacks it.
  void rememberReference(const Track& track);
  /// Returns the product stored for a belief of time `as_of`; nothing if the belief is of another
  /// run, or if too many tracks were archived since.
  std::optional<Matrix6d> referenceAt(TimePoint as_of) const;

  void clear();

 private:
  bool farAndUnseen(const Track& track, const Eigen::Vector3d& p_WB, TimePoint now,
                    TimePoint oldest) const;

  MemoryParameters parameters_;
  double min_speed_;  ///< m/s; a slower track is at rest
  /// Time since which each track could leave. It leaves once the map has a frame of this time or
  /// later on disk.
  std::map<TrackId, TimePoint> waiting_;
  TimePoint kept_;
  std::map<TimePoint, Matrix6d> references_;
};

}  // namespace perdure::semantic_filter
