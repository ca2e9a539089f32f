// Reads and writes rows of tracks that share an object. The row of the object is computed from
// them.
#pragma once

#include <optional>

#include "services/map_store/core/map_database.h"

namespace perdure::map_store {

struct StoredTrack {
  TrackId id = 0;
  PlacedBelief placed;
  std::uint64_t written = 0;  ///< revision of the map that wrote its last detections
  std::optional<TimePoint> gone;
};

// All functions run within the caller's transaction and throw Failed.

std::optional<StoredTrack> readTrack(const Connection& connection, TrackId id);
void writeTrack(const Connection& connection, const StoredTrack& track);
/// Prepares the row of a track that begins to share its object. If the track has none, copies the
/// row of its object.
void shareTrack(const Connection& connection, TrackId id);
void endTrack(const Connection& connection, TrackId id, TimePoint time);
void deleteTrack(const Connection& connection, TrackId id);

}  // namespace perdure::map_store
