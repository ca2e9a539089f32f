// All that a map holds, to be brought together with others: the graph, its objects and their
// history, where each came from, and what has changed between drives.
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

/// Why an object is history: kGone, or kMerged into another.
struct Ending {
  EventKind kind = EventKind::kGone;
  TimePoint time;
  ObjectId merged_into = 0;
  bool operator==(const Ending&) const = default;
};

struct StoredObject {
  WorldId world;  ///< of the belief
  ObjectBelief belief;
  std::optional<Ending> ended;
};

/// An object of a map that was taken in. Maps that go on from one another share their first session
/// and number their objects alike up to where they parted.
struct Origin {
  SessionIdentity map;  ///< its first session
  ObjectId id = 0;      ///< there
  ObjectId now = 0;     ///< here; it may be history since
  TimePoint first_seen;
  TimePoint last_seen;  ///< of the belief that was taken
  bool operator==(const Origin&) const = default;
};

/// What one drive saw and another one did not find any more.
struct Change {
  enum class Kind : std::uint8_t { kGone = 0, kMoved = 1 };
  Kind kind = Kind::kGone;
  ObjectId id = 0;
  std::string class_name;
  WorldId map;                                    ///< M in which the place is
  Eigen::Vector3d p_M = Eigen::Vector3d::Zero();  ///< where it stood
  TimePoint last_seen;                            ///< there
  TimePoint since;                                ///< gone, or seen elsewhere
  WorldId by;                                     ///< session that says so
  bool operator==(const Change&) const = default;
};

struct MapContents {
  SavedMap graph;
  std::map<ObjectId, StoredObject> objects;  ///< history included
  std::vector<Origin> origins;
  std::vector<Change> changes;

  std::size_t present() const;  ///< objects that have not ended
  ObjectId largestId() const;
};

/// What an object has become by merges, itself where it has not been merged.
ObjectId survivorOf(const MapContents& map, ObjectId id);

/// Whether `a` begins the fused map rather than `b`: the one with the older first session; of maps
/// that share it the one that knows more. Does not depend on an order of arguments.
bool comesFirst(const MapContents& a, const MapContents& b);

}  // namespace perdure::mapping
