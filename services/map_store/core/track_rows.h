// Rows of tracks that share an object with others. The row of the object is computed from them.
#pragma once

#include <optional>

#include "common/base/result.h"
#include "services/map_store/core/map_database.h"

namespace perdure::map_store {

struct StoredTrack {
  TrackId id = 0;
  PlacedBelief placed;
  std::uint64_t written = 0;  ///< revision of the map that its detections were written with
  std::optional<TimePoint> gone;
};

// All within the caller's transaction.

Result<std::optional<StoredTrack>> readTrack(const Connection& connection, TrackId id);
Result<void> writeTrack(const Connection& connection, const StoredTrack& track);
/// From here on it shares its object: takes what the row of the object says, if there is none yet.
Result<void> shareTrack(const Connection& connection, TrackId id);
Result<void> endTrack(const Connection& connection, TrackId id, TimePoint time);
Result<void> deleteTrack(const Connection& connection, TrackId id);

}  // namespace perdure::map_store
