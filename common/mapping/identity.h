// Stores which tracks are one object, as facts. The object id of a track is the lowest id among the
// tracks that facts connect with it. A fact from a loop closure is removed with this loop closure,
// and the object ids follow. Corrections of people (kSame, kDifferent) are evidence too: pairs are
// joined in the order of their evidence, unless people separate them with more evidence.
#pragma once

#include <compare>
#include <cstdint>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "common/base/ids.h"
#include "common/mapping/graph/pose_graph.h"
#include "common/types/corrections.h"

namespace perdure::mapping {

/// Two tracks are one object.
struct SameObject {
  EdgeId loop = 0;  ///< loop closure that shows it; 0: found by the filter, and final
  TrackId a = 0, b = 0;
  auto operator<=>(const SameObject&) const = default;
};

/// Evidence of a fact from a loop closure: the default of LoopParameters::nats.
inline constexpr double kLoopFactNats = 8.0;

/// Two objects became one, or were separated again.
struct MergeOrder {
  EdgeId loop = 0;
  ObjectId survivor = 0;  ///< the object with the lower id
  ObjectId absorbed = 0;
};

class Identity {
 public:
  Identity() = default;
  explicit Identity(std::set<SameObject> facts, std::vector<Correction> corrections = {});

  void add(const SameObject& fact);
  /// Removes the facts of a loop closure.
  void endLoop(EdgeId loop);
  /// Moves the facts of a loop closure to the one that replaces it.
  void replaceLoop(EdgeId loop, EdgeId by);
  /// Replaces all corrections, sorted by id, of all kinds.
  void setCorrections(std::vector<Correction> corrections);
  const std::vector<Correction>& corrections() const { return corrections_; }

  ObjectId objectOf(TrackId track) const;
  /// Returns the object without the kSame corrections. The filter fuses these tracks only.
  ObjectId observedObjectOf(TrackId track) const;
  /// Returns the tracks whose objects may change with a fact or correction about a and b.
  std::set<TrackId> reachOf(TrackId a, TrackId b) const;
  /// Whether people state on the whole that the objects of the tracks are two.
  bool areSeparated(TrackId a, TrackId b) const;
  /// Returns the tracks, by id, of an object that has several; empty for other objects.
  const std::vector<TrackId>& tracksOf(ObjectId object) const;
  const std::set<SameObject>& facts() const { return facts_; }
  std::vector<SameObject> factsOf(EdgeId loop) const;
  std::set<SameObject> mergesByFilter() const;  ///< facts without a loop
  /// The objects that have several tracks.
  const std::map<ObjectId, std::vector<TrackId>>& shared() const { return tracks_of_; }
  /// Whether a fact connects the track with another one.
  bool isShared(TrackId track) const { return object_of_.contains(track); }

 private:
  using Pair = std::pair<TrackId, TrackId>;
  using Objects = std::map<TrackId, ObjectId>;
  void connect();
  Objects joined(bool by_people) const;

  std::set<SameObject> facts_;
  std::vector<Correction> corrections_;
  std::map<Pair, double> stated_;  ///< nats of all corrections of a pair; < 0: two objects
  Objects object_of_;
  Objects observed_object_of_;  ///< empty if there are no corrections about two objects
  std::map<ObjectId, std::vector<TrackId>> tracks_of_;
};

}  // namespace perdure::mapping
