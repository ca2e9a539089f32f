// Adds the sessions, anchors and edges of another map to a map, and stores their new ids.
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

  /// Returns the world in the united map for a world of the other map. A new world gets a free
  /// number.
  const WorldId& worldOf(const WorldId& world);
  /// Returns the record of `theirs` in ids of the united map; `id` becomes its object id. Returns
  /// nothing if there is no record, or if its part of the trajectory was left out.
  std::optional<ObjectRecord> recordOf(ObjectId theirs, ObjectId id) const;
  /// Returns whether a sighting of the record belongs to a session that both maps contain. The
  /// record must have ids of the united map.
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
  std::map<WorldId, WorldId> world_of_;  ///< key: world of the other map; value: of this map
  std::map<std::uint64_t, std::uint64_t> number_of_;
  std::map<WorldId, std::vector<AnchorId>> new_anchors_;
  std::map<WorldId, AnchorId> first_new_;  ///< key: world in this map
  std::map<AnchorId, AnchorId> anchor_of_, frames_, first_of_;
  std::set<AnchorId> new_ids_;
  std::vector<std::uint32_t> class_of_;
};

}  // namespace perdure::mapping
