// The complete contents of a map, for fusion with other maps: the graph, objects and their history,
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

/// The reason why an object is history: kGone, or kMerged into another object.
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

/// The origin of an object from another map. Maps that continue one another share their first
/// session, and have equal object ids up to the point where they diverge.
struct Origin {
  SessionIdentity map;  ///< first session of the other map
  ObjectId id = 0;      ///< id in the other map
  ObjectId now = 0;     ///< id in this map; the object may be history since
  TimePoint first_seen;
  TimePoint last_seen;  ///< last sighting in the belief that was copied
  bool operator==(const Origin&) const = default;
};

/// A difference between an earlier drive and a later one.
struct Change {
  enum class Kind : std::uint8_t { kGone = 0, kMoved = 1 };
  Kind kind = Kind::kGone;
  ObjectId id = 0;
  std::string class_name;
  WorldId map;                                    ///< M of the place
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

/// The object that an object was merged into; itself if it has not been merged.
ObjectId survivorOf(const MapContents& map, ObjectId id);

/// Returns whether `a`, and not `b`, is the first map of a fusion. The map with the older first
/// session comes first; if both share that session, the map with more contents does. The result
/// does not depend on the order of the arguments.
bool comesFirst(const MapContents& a, const MapContents& b);

}  // namespace perdure::mapping
