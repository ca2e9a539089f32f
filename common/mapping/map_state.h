// What the mapper knows: anchors, the graph over them, and where each object was seen from. Keeps
// book of what has changed since it was saved.
#pragma once

#include <cstdint>
#include <map>
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
  void removeLoop(EdgeId id);
  void scaleOdometry(double factor, const WorldId& session);
  void optimise() { (void)graph_.optimise(); }
  /// Moves a component as one: T_MA = T_MN T_NA.
  void move(const std::set<AnchorId>& anchors, const LevelPose& T_MN);

  /// What an anchor looks like; empty where no landmark was seen.
  const View& viewFrom(AnchorId id) const;
  void putView(AnchorId id, View view);

  const std::map<ObjectId, ObjectRecord>& records() const { return records_; }
  void put(ObjectId id, ObjectRecord record);
  void erase(ObjectId id);
  const std::set<ObjectId>& unconfirmed() const { return unconfirmed_; }
  /// Objects that were seen from an anchor, on the newest visit or on the one before.
  const std::set<ObjectId>& seenFrom(AnchorId id) const;

  /// Merges that hang on loops, by the absorbed object.
  const std::map<ObjectId, HungMerge>& merges() const { return merges_; }
  void putMerge(ObjectId absorbed, HungMerge merge);
  void eraseMerge(ObjectId absorbed);

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
  SavedAnchor savedAnchor(AnchorId id) const;
  bool isSaved(AnchorId id) const;

  PoseGraph graph_;
  std::map<AnchorId, Anchor> anchors_;
  std::map<ObjectId, ObjectRecord> records_;
  std::map<AnchorId, std::set<ObjectId>> seen_from_;
  std::set<ObjectId> unconfirmed_;
  std::map<std::string, std::uint32_t> class_numbers_;
  std::map<AnchorId, Kept> saved_anchors_;
  std::map<EdgeId, double> saved_edges_;  ///< weights of loops
  std::set<ObjectId> touched_, erased_;
  std::map<ObjectId, HungMerge> merges_;
  std::set<ObjectId> merges_touched_, merges_erased_;
  std::map<AnchorId, View> views_;
  std::set<AnchorId> views_touched_;
};

}  // namespace perdure::mapping
