// The state of the mapper: anchors, their graph, which tracks are one object, and the anchors from
// which objects were detected. Records of objects with several tracks are computed from those of
// the tracks. Records all changes since it was last saved.
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
  /// The covariance of the anchor's increment must be scaled already.
  void add(const Anchor& anchor);
  const std::map<AnchorId, Anchor>& anchors() const { return anchors_; }
  /// The newest anchor of a session.
  std::optional<Anchor> newestOf(const WorldId& session) const;

  const PoseGraph& graph() const { return graph_; }
  EdgeId addLoop(const Edge& edge) { return graph_.add(edge); }
  /// Also ends the facts that depend on it.
  void removeLoop(EdgeId id);
  /// Sets the factor of all increments of the session.
  void scaleOdometry(const DriftVariance& scale, const WorldId& session);
  void optimise() { (void)graph_.optimise(); }
  /// Moves a component as a whole: T_MA = T_MN T_NA.
  void move(const std::set<AnchorId>& anchors, const LevelPose& T_MN);

  /// The view from an anchor; empty if no landmark was observed.
  const View& viewFrom(AnchorId id) const;
  void putView(AnchorId id, View view);

  /// Records by object. If an object has several tracks, `earlier` and `sighting` may be of
  /// different tracks; the id in `in_anchor` names the track.
  const std::map<ObjectId, ObjectRecord>& records() const { return records_; }
  /// Returns null if the track is unknown.
  const ObjectRecord* recordOfTrack(TrackId id) const;
  void put(TrackId id, ObjectRecord record);
  /// The object has ended, according to this track.
  void end(TrackId id);
  /// The track was merged into another one. Removes its record.
  void erase(TrackId id);
  /// Records of this session count as newer than those of any other.
  void follow(const WorldId& session) { session_ = session; }
  bool isNewer(const ObjectRecord& a, const ObjectRecord& b) const;
  const std::set<ObjectId>& unconfirmed() const { return unconfirmed_; }
  /// Objects that were detected from an anchor, on the newest visit or on the one before.
  const std::set<ObjectId>& seenFrom(AnchorId id) const;

  const Identity& identity() const { return identity_; }
  void unite(const SameObject& fact);
  /// Moves the facts of a loop closure to another one.
  void replaceLoop(EdgeId loop, EdgeId by) { identity_.replaceLoop(loop, by); }
  /// Tracks whose object has changed since markSaved(), or that have begun or ceased to share it.
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
  void regroup(const Groups& before);
  SavedAnchor savedAnchor(AnchorId id) const;
  bool isSaved(AnchorId id) const;

  double visit_m_;  ///< distance travelled after which a new visit begins
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
  std::map<AnchorId, View> views_;
  std::set<AnchorId> views_touched_;
};

}  // namespace perdure::mapping
