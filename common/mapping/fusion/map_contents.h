// The complete contents of a map, for fusion with other maps: the graph, objects including history,
// their origins, and the changes between drives.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/mapping/fusion/session_identity.h"
#include "common/mapping/saved_map.h"
#include "common/types/objects.h"

namespace perdure::mapping {

/// The end of an object that is history: kGone, or kMerged into another object.
struct Ending {
  EventKind kind = EventKind::kGone;
  TimePoint time;
  ObjectId merged_into = 0;
  bool operator==(const Ending&) const = default;
};

struct StoredObject {
  WorldId world;  ///< frame of reference of the belief
  ObjectBelief belief;
  std::optional<Ending> ended;
};

/// The origin of an object that comes from another map. If one map continues another, both have the
/// same first session, and equal object ids up to the point where they diverge.
struct Origin {
  SessionIdentity map;  ///< first session of the other map
  ObjectId id = 0;      ///< id in the other map
  ObjectId now = 0;     ///< id in this map; the object may have become history
  TimePoint first_seen;
  TimePoint last_seen;  ///< last sighting that the copied belief contains
  bool operator==(const Origin&) const = default;
};

/// A difference between an earlier drive and a later one.
struct Change {
  enum class Kind : std::uint8_t { kGone = 0, kMoved = 1 };
  Kind kind = Kind::kGone;
  ObjectId id = 0;
  std::string class_name;
  WorldId map;                                    ///< M in which `p_M` is given
  Eigen::Vector3d p_M = Eigen::Vector3d::Zero();  ///< earlier position
  TimePoint last_seen;                            ///< last sighting at that position
  TimePoint since;                                ///< time at which it was found gone or elsewhere
  WorldId by;                                     ///< session that detected the change
  bool operator==(const Change&) const = default;
};

struct MapContents {
  SavedMap graph;
  std::map<ObjectId, StoredObject> objects;  ///< including history
  std::vector<Origin> origins;
  std::vector<Change> changes;

  std::size_t present() const;  ///< number of objects that have not ended
  ObjectId largestId() const;
};

/// Returns the present id of an object after all merges; `id` if it has not been merged.
ObjectId survivorOf(const MapContents& map, ObjectId id);

/// Returns whether `a`, and not `b`, is the first map of a fusion. The map with the older first
/// session comes first; if both share that session, the map with more contents does. The result
/// does not depend on the order of the arguments.
bool comesFirst(const MapContents& a, const MapContents& b);

}  // namespace perdure::mapping
