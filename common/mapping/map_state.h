// What the mapper knows: anchors, the graph over them, which tracks are one object, and from where
// each object was seen. Records of objects that have several tracks are computed from those of the
// tracks. Keeps book of what has changed since it was saved.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>

#include "common/mapping/graph/pose_graph.h"
#include "common/mapping/saved_map.h"

namespace perdure::mapping {

class MapState {
 public:
  MapState(const GraphParameters& parameters, SavedMap saved);

  std::uint32_t numberOf(const std::string& class_name);

  AnchorId nextAnchor() const { return anchors_.empty() ? 1 : anchors_.rbegin()->first + 1; }
  /// Its increment's covariance as it is to count.
  void add(const Anchor& anchor);
  const std::map<AnchorId, Anchor>& anchors() const { return anchors_; }
  /// The newest anchor of a session.
  std::optional<Anchor> newestOf(const WorldId& session) const;

  const PoseGraph& graph() const { return graph_; }
  EdgeId addLoop(const Edge& edge) { return graph_.add(edge); }
  /// Ends the facts that rest on it, too.
  void removeLoop(EdgeId id);
  void scaleOdometry(double factor, const WorldId& session);
  void optimise() { (void)graph_.optimise(); }
  /// Moves a component as one: T_MA = T_MN T_NA.
  void move(const std::set<AnchorId>& anchors, const LevelPose& T_MN);

  /// What an anchor looks like; empty where no landmark was seen.
  const View& viewFrom(AnchorId id) const;
  void putView(AnchorId id, View view);

  /// Of objects. `earlier` of an object that has several tracks may be of another track than
  /// `sighting`: the id in `in_anchor` names it.
  const std::map<ObjectId, ObjectRecord>& records() const { return records_; }
  /// Null: the track is not known.
  const ObjectRecord* recordOfTrack(TrackId id) const;
  void put(TrackId id, ObjectRecord record);
  /// The object of the track has ended, as far as this track is concerned.
  void end(TrackId id);
  /// The track was merged into another one: it leaves no record.
  void erase(TrackId id);
  /// The session whose records count as newer than any other's.
  void follow(const WorldId& session) { session_ = session; }
  bool isNewer(const ObjectRecord& a, const ObjectRecord& b) const;
  const std::set<ObjectId>& unconfirmed() const { return unconfirmed_; }
  /// Objects that were seen from an anchor, on the newest visit or on the one before.
  const std::set<ObjectId>& seenFrom(AnchorId id) const;

  const Identity& identity() const { return identity_; }
  void unite(const SameObject& fact);
  /// The facts that rest on a loop closure rest on another one.
  void replaceLoop(EdgeId loop, EdgeId by) { identity_.replaceLoop(loop, by); }
  /// Tracks whose object has changed since markSaved(), or that share it now, or no longer.
  const std::set<TrackId>& regrouped() const { return regrouped_; }

  Unsaved unsaved() const;
  void markSaved();

 private:
  /// As it was saved last.
  struct Kept {
    LevelPose T_MA;
    double scale2 = 1.0;
  };
  void index(ObjectId id, const ObjectRecord& record);
  void unindex(ObjectId id, const ObjectRecord& record);
  void putObject(ObjectId id, ObjectRecord record);
  void eraseObject(ObjectId id);
  std::optional<ObjectRecord> combined(ObjectId object) const;
  void combine(ObjectId object);
  void endFactsOf(EdgeId loop);
  /// Tracks, each with its object.
  using Groups = std::map<TrackId, ObjectId>;
  Groups groupsOf(TrackId a, TrackId b) const;
  void regroup(const Groups& before);
  SavedAnchor savedAnchor(AnchorId id) const;
  bool isSaved(AnchorId id) const;

  PoseGraph graph_;
  std::map<AnchorId, Anchor> anchors_;
  std::map<ObjectId, ObjectRecord> records_;
  std::map<TrackId, ObjectRecord> tracks_;  ///< of objects that have several
  Identity identity_;
  WorldId session_;
  std::map<AnchorId, std::set<ObjectId>> seen_from_;
  std::set<ObjectId> unconfirmed_;
  std::map<std::string, std::uint32_t> class_numbers_;
  std::map<AnchorId, Kept> saved_anchors_;
  std::map<EdgeId, double> saved_edges_;  ///< weights of loops
  std::set<ObjectId> touched_, erased_;
  std::set<TrackId> tracks_touched_, tracks_erased_, regrouped_;
  std::set<SameObject> saved_facts_;
  std::map<AnchorId, View> views_;
  std::set<AnchorId> views_touched_;
};

}  // namespace perdure::mapping
