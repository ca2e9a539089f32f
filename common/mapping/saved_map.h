// The stored part of the map besides the beliefs: anchors, edges, views, facts, and the sightings
// of each object. `Mapper` returns the changes. The store commits them in the same transaction as
// the objects, and loads them bit for bit at the next start.
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

/// The record of a track, or of an object with one or several tracks.
struct ObjectRecord {
  WorldId session;
  double way_m = 0.0;  ///< distance travelled in the session at its last detection
  TimePoint last_seen;
  Matrix6d pose_error = Matrix6d::Zero();  ///< covariance of the body's pose error [θ, p] at that
                                           ///< time
  Sighting sighting;                       ///< the newest sighting
  std::optional<Sighting> earlier;         ///< the sighting of the visit before, if any
  bool confirmed = false;                  ///< confirmed at any time; only such objects are on the
                                           ///< map and saved
  bool gone = false;  ///< the filter deleted this track; set only for tracks that share an object
};

struct SavedAnchor {
  Anchor anchor;
  LevelPose T_MA;          ///< pose in M by the graph
  bool held_fast = false;  ///< whether it is the fixed anchor of its component
};

struct SavedEdge {
  Edge edge;            ///< its covariance includes the learned scale
  double weight = 1.0;  ///< at the last optimisation, (0, 1]
};

/// The whole state, or changes: rows that replace the stored ones of the same ids.
struct SavedMap {
  std::vector<std::string> classes;  ///< all class names, indexed by ClassShare::name
  std::map<AnchorId, SavedAnchor> anchors;
  std::map<EdgeId, SavedEdge> edges;
  std::map<ObjectId, ObjectRecord> records;     ///< records by object
  std::map<TrackId, ObjectRecord> tracks = {};  ///< records of tracks that share an object
  std::set<SameObject> facts = {};
  std::vector<Correction> corrections = {};  ///< by people, sorted by id
  std::map<AnchorId, View> views = {};       ///< views from anchors with landmarks
};

struct Unsaved {
  SavedMap changed;
  std::set<EdgeId> edges_gone;
  std::set<ObjectId> records_gone;
  std::set<TrackId> tracks_gone = {};
  std::set<SameObject> facts_gone = {};
};

}  // namespace perdure::mapping
