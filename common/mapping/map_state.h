// The state of the mapper: anchors, their graph, the records of objects, and the tracks that are
// one object. The record of an object with several tracks is computed from those of its tracks. The
// state stores all changes since the last save.
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
  MapState(const Parameters& parameters, SavedMap saved);

  std::uint32_t numberOf(const std::string& class_name);

  AnchorId nextAnchor() const { return anchors_.empty() ? 1 : anchors_.rbegin()->first + 1; }
  /// Adds an anchor. The covariance of its increment must have been multiplied by `scale`.
  void add(const Anchor& anchor);
  const std::map<AnchorId, Anchor>& anchors() const { return anchors_; }
  /// The newest anchor of a session.
  std::optional<Anchor> newestOf(const WorldId& session) const;

  const PoseGraph& graph() const { return graph_; }
  EdgeId addLoop(const Edge& edge) { return graph_.add(edge); }
  /// Removes a loop closure and its facts.
  void removeLoop(EdgeId id);
  /// Sets the factors of the covariances of all increments of the session.
  void scaleOdometry(const DriftVariance& scale, const WorldId& session);
  void optimise() { (void)graph_.optimise(); }
  /// Moves a component as a whole: T_MA = T_MN T_NA.
  void move(const std::set<AnchorId>& anchors, const LevelPose& T_MN);

  /// Returns the view from an anchor; empty if there is none.
  const View& viewFrom(AnchorId id) const;
  void putView(AnchorId id, View view);

  /// Records by object. If an object has several tracks, `earlier` and `sighting` may be of
  /// different tracks; `in_anchor.id` is that of the track.
  const std::map<ObjectId, ObjectRecord>& records() const { return records_; }
  /// Returns null if the track is unknown.
  const ObjectRecord* recordOfTrack(TrackId id) const;
  void put(TrackId id, ObjectRecord record);
  /// Marks a track as gone. Its object ends if this is its newest track.
  void end(TrackId id);
  /// Removes the record of a track, because it was merged or was never confirmed.
  void erase(TrackId id);
  /// Sets the present session. Its records count as newer than those of all other sessions.
  void follow(const WorldId& session) { session_ = session; }
  bool isNewer(const ObjectRecord& a, const ObjectRecord& b) const;
  const std::set<ObjectId>& unconfirmed() const { return unconfirmed_; }
  /// Objects whose newest or earlier sighting belongs to the anchor.
  const std::set<ObjectId>& seenFrom(AnchorId id) const;

  const Identity& identity() const { return identity_; }
  void unite(const SameObject& fact);
  /// Adds a correction, or replaces the one with its id.
  void put(const Correction& correction);
  /// Moves the facts of a loop closure to another one.
  void replaceLoop(EdgeId loop, EdgeId by) { identity_.replaceLoop(loop, by); }
  /// Tracks whose object id has changed since markSaved(), or that began or ceased to share an
  /// object.
  const std::set<TrackId>& regrouped() const { return regrouped_; }

  Unsaved unsaved() const;
  void markSaved();

 private:
  /// The state at the last save.
  struct Kept {
    LevelPose T_MA;
    DriftVariance scale;
  };
  void index(ObjectId id, const ObjectRecord& record);
  void unindex(ObjectId id, const ObjectRecord& record);
  void putObject(ObjectId id, ObjectRecord record);
  void eraseObject(ObjectId id);
  std::optional<ObjectRecord> combined(ObjectId object) const;
  void combine(ObjectId object);
  void endFactsOf(EdgeId loop);
  /// The object of each track.
  using Groups = std::map<TrackId, ObjectId>;
  Groups groupsOf(TrackId a, TrackId b) const;
  void regroup(Groups before);
  SavedAnchor savedAnchor(AnchorId id) const;
  bool isSaved(AnchorId id) const;

  double visit_m_;  ///< distance travelled without detection after which a new visit begins
  PoseGraph graph_;
  std::map<AnchorId, Anchor> anchors_;
  std::map<ObjectId, ObjectRecord> records_;
  std::map<TrackId, ObjectRecord> tracks_;  ///< records of tracks that share an object
  Identity identity_;
  WorldId session_;
  std::map<AnchorId, std::set<ObjectId>> seen_from_;
  std::set<ObjectId> unconfirmed_;
  std::map<std::string, std::uint32_t> class_numbers_;
  std::map<AnchorId, Kept> saved_anchors_;
  std::map<EdgeId, double> saved_edges_;  ///< weights of loop closures at the last save
  std::set<ObjectId> touched_, erased_;
  std::set<TrackId> tracks_touched_, tracks_erased_, regrouped_;
  std::set<SameObject> saved_facts_;
  std::vector<Correction> unsaved_corrections_;
  std::map<AnchorId, View> views_;
  std::set<AnchorId> views_touched_;
};

}  // namespace perdure::mapping
