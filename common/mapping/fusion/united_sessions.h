// Adds the sessions, anchors and edges of another map to a map, and records their new numbers.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <vector>

#include "common/mapping/fusion/map_contents.h"
#include "common/mapping/fusion/united_map.h"

namespace perdure::mapping {

class UnitedSessions {
 public:
  /// Modifies the graph of `map`. Stores references to all three arguments.
  UnitedSessions(MapContents& map, const MapContents& other, Addition& addition);

  /// The world in the united map for a world of the other map. A new world receives a free number.
  const WorldId& worldOf(const WorldId& world);
  /// A record of the other map in the united map's ids. Returns nothing if it does not exist, or if
  /// its part of the trajectory was left out.
  std::optional<ObjectRecord> recordOf(ObjectId theirs, ObjectId id) const;
  /// Returns whether a sighting of the record, in ids of the united map, belongs to a session that
  /// both maps contain.
  bool wasSeenInBoth(const ObjectRecord& record) const;
  bool isNew(AnchorId id) const { return new_ids_.contains(id); }

 private:
  WorldId freeWorld(const WorldId& world) const;
  WorldId otherWorld(const WorldId& world) const;
  void matchWorlds();
  void matchAnchors();
  void matchAnchors(const Session& session, const Session& same);
  void makeRoom();
  void moveUp();
  void renumber(const std::map<AnchorId, AnchorId>& moved);
  void addAnchors();
  AnchorId reference(AnchorId id, const std::map<AnchorId, AnchorId>& known,
                     const std::map<AnchorId, AnchorId>& components) const;
  void addAnchor(AnchorId theirs, AnchorId id, AnchorId reference, AnchorId component);
  void addEdges();
  void addClasses();
  bool take(Sighting& sighting, ObjectId id) const;

  MapContents& map_;
  const MapContents& other_;
  Addition& addition_;
  const std::vector<Session> sessions_, other_sessions_;
  std::set<WorldId> worlds_;         ///< worlds of the map
  std::set<std::uint64_t> numbers_;  ///< numbers of these worlds
  std::map<WorldId, const Session*> known_;
  std::map<WorldId, WorldId> world_of_;  ///< other map to this map; also the next two
  std::map<std::uint64_t, std::uint64_t> number_of_;
  std::map<WorldId, std::vector<AnchorId>> new_anchors_;
  std::map<WorldId, AnchorId> first_new_;  ///< key: world in this map
  std::map<AnchorId, AnchorId> anchor_of_, frames_, first_of_;
  std::set<AnchorId> new_ids_;
  std::vector<std::uint32_t> class_of_;
};

}  // namespace perdure::mapping
