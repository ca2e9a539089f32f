// Stores which tracks are one object, as facts. The object id of a track is the lowest id among the
// tracks that facts connect with it. A fact from a loop closure is removed with this loop closure,
// and the object ids follow.
#pragma once

#include <compare>
#include <map>
#include <set>
#include <vector>

#include "common/base/ids.h"
#include "common/mapping/graph/pose_graph.h"

namespace perdure::mapping {

/// Two tracks are one object.
struct SameObject {
  EdgeId loop = 0;  ///< loop closure that shows it; 0: found by the filter, and final
  TrackId a = 0, b = 0;
  auto operator<=>(const SameObject&) const = default;
};

/// Two objects became one, or were separated again.
struct MergeOrder {
  EdgeId loop = 0;
  ObjectId survivor = 0;  ///< the object with the lower id
  ObjectId absorbed = 0;
};

class Identity {
 public:
  Identity() = default;
  explicit Identity(std::set<SameObject> facts);

  void add(const SameObject& fact);
  /// Removes the facts of a loop closure.
  void endLoop(EdgeId loop);
  /// Moves the facts of a loop closure to the one that replaces it.
  void replaceLoop(EdgeId loop, EdgeId by);

  ObjectId objectOf(TrackId track) const;
  /// Returns the tracks, by id, of an object that has several; empty for other objects.
  const std::vector<TrackId>& tracksOf(ObjectId object) const;
  const std::set<SameObject>& facts() const { return facts_; }
  std::vector<SameObject> factsOf(EdgeId loop) const;
  /// The objects that have several tracks.
  const std::map<ObjectId, std::vector<TrackId>>& shared() const { return tracks_of_; }
  /// Whether a fact connects the track with another one.
  bool isShared(TrackId track) const { return object_of_.contains(track); }

 private:
  void connect();

  std::set<SameObject> facts_;
  std::map<TrackId, ObjectId> object_of_;
  std::map<ObjectId, std::vector<TrackId>> tracks_of_;
};

}  // namespace perdure::mapping
