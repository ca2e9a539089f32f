// What of the map outlives the process, beside the objects themselves: anchors, edges, and where
// each object was seen from. `Mapper` says what has changed; the store keeps it in the transaction
// in which it keeps the objects, and gives all of it back at the next start, bit for bit.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/base/ids.h"
#include "common/mapping/appearance/view.h"
#include "common/mapping/frames/anchor.h"
#include "common/mapping/graph/pose_graph.h"
#include "common/mapping/identity.h"
#include "common/mapping/places/placed_object.h"
#include "common/types/odometry.h"

namespace perdure::mapping {

/// An object as it was seen on one visit, in the axes of an anchor.
struct Sighting {
  AnchorId anchor = 0;
  PlacedObject in_anchor;
};

/// What the mapper knows of a track, or of an object by all of its tracks.
struct ObjectRecord {
  WorldId session;
  double way_m = 0.0;  ///< of the session when it was last detected
  TimePoint last_seen;
  Matrix6d pose_error = Matrix6d::Zero();  ///< of the body then, [θ, p]
  Sighting sighting;                       ///< the newest
  std::optional<Sighting> earlier;         ///< of the visit before, if it came back
  bool confirmed = false;                  ///< once: it is on the map. Others are not saved
  bool gone = false;                       ///< of a track alone: its object has ended
};

struct SavedAnchor {
  Anchor anchor;
  LevelPose T_MA;          ///< as the graph has it
  bool held_fast = false;  ///< the first one of its component
};

struct SavedEdge {
  Edge edge;            ///< its covariance as it counts, learned scale included
  double weight = 1.0;  ///< of the last optimisation, (0, 1]
};

/// All of it, or what has changed and replaces what is stored under the same ids.
struct SavedMap {
  std::vector<std::string> classes;  ///< names by the numbers in ClassShare; always all of them
  std::map<AnchorId, SavedAnchor> anchors;
  std::map<EdgeId, SavedEdge> edges;
  std::map<ObjectId, ObjectRecord> records;     ///< of objects
  std::map<TrackId, ObjectRecord> tracks = {};  ///< of objects that have several tracks
  std::set<SameObject> facts = {};
  std::map<AnchorId, View> views = {};        ///< what anchors look like, where landmarks were seen
};

struct Unsaved {
  SavedMap changed;
  std::set<EdgeId> edges_gone;
  std::set<ObjectId> records_gone;
  std::set<TrackId> tracks_gone = {};
  std::set<SameObject> facts_gone = {};
};

}  // namespace perdure::mapping
