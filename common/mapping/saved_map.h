// The part of the map that outlives the process, besides the objects: anchors, edges, and the
// sightings of each object. `Mapper` reports the changes. The store commits them in the same
// transaction as the objects, and returns them bit by bit at the next start.
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

/// An object as detected on one visit, in the axes of an anchor.
struct Sighting {
  AnchorId anchor = 0;
  PlacedObject in_anchor;
};

/// The record of a track, or of an object from all of its tracks.
struct ObjectRecord {
  WorldId session;
  double way_m = 0.0;  ///< distance travelled in the session at its last detection
  TimePoint last_seen;
  Matrix6d pose_error = Matrix6d::Zero();  ///< the body's pose error at that time, [θ, p]
  Sighting sighting;                       ///< the newest sighting
  std::optional<Sighting> earlier;         ///< on the visit before, if it was detected again
  bool confirmed = false;                  ///< ever confirmed, so it is on the map; others are not
                                           ///< saved
  bool gone = false;  ///< the filter deleted this track; only of tracks that share an object
};

struct SavedAnchor {
  Anchor anchor;
  LevelPose T_MA;          ///< by the graph
  bool held_fast = false;  ///< whether it is the fixed anchor of its component
};

struct SavedEdge {
  Edge edge;            ///< its covariance includes the learned scale
  double weight = 1.0;  ///< at the last optimisation, (0, 1]
};

/// The whole state, or changes that replace the stored rows of the same ids.
struct SavedMap {
  std::vector<std::string> classes;  ///< all class names, indexed by ClassShare::name
  std::map<AnchorId, SavedAnchor> anchors;
  std::map<EdgeId, SavedEdge> edges;
  std::map<ObjectId, ObjectRecord> records;     ///< records by object
  std::map<TrackId, ObjectRecord> tracks = {};  ///< records of tracks that share an object
  std::set<SameObject> facts = {};
  std::map<AnchorId, View> views = {};  ///< views from anchors with landmarks
};

struct Unsaved {
  SavedMap changed;
  std::set<EdgeId> edges_gone;
  std::set<ObjectId> records_gone;
  std::set<TrackId> tracks_gone = {};
  std::set<SameObject> facts_gone = {};
};

}  // namespace perdure::mapping
