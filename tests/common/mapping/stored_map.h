// The store of a mapper, in memory: applies the reported changes and compares two maps.
#pragma once

#include <gtest/gtest.h>

#include <map>
#include <string>
#include <vector>

#include "common/mapping/saved_map.h"

namespace perdure::mapping::test {

/// Applies changes as the store does.
inline void apply(const Unsaved& unsaved, SavedMap& map) {
  map.classes = unsaved.changed.classes;
  for (const auto& [id, anchor] : unsaved.changed.anchors) map.anchors[id] = anchor;
  for (const auto& [id, edge] : unsaved.changed.edges) map.edges[id] = edge;
  for (const auto& [id, record] : unsaved.changed.records) map.records[id] = record;
  for (const auto& [id, record] : unsaved.changed.tracks) map.tracks[id] = record;
  map.facts.insert(unsaved.changed.facts.begin(), unsaved.changed.facts.end());
  for (const auto& [id, view] : unsaved.changed.views) map.views[id] = view;
  for (const TrackId id : unsaved.tracks_gone) {
    map.tracks.erase(id);
    EXPECT_FALSE(unsaved.changed.tracks.contains(id)) << "track " << id << " is both";
  }
  for (const SameObject& fact : unsaved.facts_gone) {
    map.facts.erase(fact);
    EXPECT_FALSE(unsaved.changed.facts.contains(fact)) << "a fact of loop " << fact.loop;
  }
  for (const EdgeId id : unsaved.edges_gone) {
    map.edges.erase(id);
    EXPECT_FALSE(unsaved.changed.edges.contains(id)) << "edge " << id << " is both";
  }
  for (const ObjectId id : unsaved.records_gone) {
    map.records.erase(id);
    EXPECT_FALSE(unsaved.changed.records.contains(id)) << "object " << id << " is both";
  }
}

inline bool isEmpty(const Unsaved& unsaved) {
  return unsaved.changed.anchors.empty() && unsaved.changed.edges.empty() &&
         unsaved.changed.records.empty() && unsaved.edges_gone.empty() &&
         unsaved.records_gone.empty() && unsaved.changed.tracks.empty() &&
         unsaved.tracks_gone.empty() && unsaved.changed.facts.empty() &&
         unsaved.facts_gone.empty() && unsaved.changed.views.empty();
}

template <class Map>
std::vector<typename Map::key_type> keysOf(const Map& map) {
  std::vector<typename Map::key_type> keys;
  for (const auto& [key, value] : map) keys.push_back(key);
  return keys;
}

inline void expectSame(const LevelGaussian& a, const LevelGaussian& b, const std::string& what) {
  EXPECT_EQ(a.mean.p, b.mean.p) << what;
  EXPECT_EQ(a.mean.yaw, b.mean.yaw) << what;
  EXPECT_EQ(a.covariance, b.covariance) << what;
}

inline void expectSame(const Sighting& a, const Sighting& b, const std::string& what) {
  EXPECT_EQ(a.anchor, b.anchor) << what;
  EXPECT_EQ(a.in_anchor.id, b.in_anchor.id) << what;
  EXPECT_EQ(a.in_anchor.p, b.in_anchor.p) << what;
  EXPECT_EQ(a.in_anchor.yaw, b.in_anchor.yaw) << what;
  EXPECT_EQ(a.in_anchor.covariance, b.in_anchor.covariance) << what;
}

inline void expectSame(const ObjectRecord& a, const ObjectRecord& b, const std::string& what) {
  EXPECT_EQ(a.session, b.session) << what;
  EXPECT_EQ(a.way_m, b.way_m) << what;
  EXPECT_EQ(a.last_seen, b.last_seen) << what;
  EXPECT_EQ(a.pose_error, b.pose_error) << what;
  EXPECT_EQ(a.confirmed, b.confirmed) << what;
  EXPECT_EQ(a.gone, b.gone) << what;
  expectSame(a.sighting, b.sighting, what);
  ASSERT_EQ(a.earlier.has_value(), b.earlier.has_value()) << what;
  if (a.earlier) expectSame(*a.earlier, *b.earlier, what + ", earlier");
}

inline void expectSame(const std::map<ObjectId, ObjectRecord>& a,
                       const std::map<ObjectId, ObjectRecord>& b, const std::string& what) {
  ASSERT_EQ(keysOf(a), keysOf(b)) << what;
  for (const auto& [id, record] : a) {
    expectSame(record, b.at(id), what + " " + std::to_string(id));
  }
}

/// Compares bit by bit.
inline void expectSame(const SavedMap& a, const SavedMap& b) {
  EXPECT_EQ(a.classes, b.classes);
  ASSERT_EQ(keysOf(a.anchors), keysOf(b.anchors));
  ASSERT_EQ(keysOf(a.edges), keysOf(b.edges));
  EXPECT_EQ(a.facts, b.facts);
  for (const auto& [id, x] : a.anchors) {
    const SavedAnchor& y = b.anchors.at(id);
    const std::string what = "anchor " + std::to_string(id);
    EXPECT_EQ(x.T_MA.p, y.T_MA.p) << what;
    EXPECT_EQ(x.T_MA.yaw, y.T_MA.yaw) << what;
    expectSame(x.anchor.from_previous, y.anchor.from_previous, what);
    EXPECT_EQ(x.anchor.scale, y.anchor.scale) << what;
    EXPECT_EQ(x.anchor.T_WA.p, y.anchor.T_WA.p) << what;
  }
  for (const auto& [id, x] : a.edges) {
    const SavedEdge& y = b.edges.at(id);
    const std::string what = "edge " + std::to_string(id);
    EXPECT_EQ(x.weight, y.weight) << what;
    EXPECT_EQ(x.edge.kind, y.edge.kind) << what;
    expectSame(x.edge.T_ab, y.edge.T_ab, what);
  }
  expectSame(a.records, b.records, "object");
  expectSame(a.tracks, b.tracks, "track");
}

}  // namespace perdure::mapping::test
