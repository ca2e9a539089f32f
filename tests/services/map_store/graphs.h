// Pose graphs with random contents for the tests of map_store, and their bit patterns.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <random>
#include <string>

#include "services/map_store/core/graph/graph_codec.h"

namespace perdure::map_store::test {

struct GraphSize {
  std::size_t anchors = 40, edges = 60, records = 100, sessions = 2, shared = 5, views = 12;
};

class RandomGraph {
 public:
  explicit RandomGraph(std::uint32_t seed) : random_(seed) {}

  mapping::SavedMap map(const GraphSize& size) {
    mapping::SavedMap map;
    map.classes = {"car", "other", "Straßenlaterne"};
    for (std::uint64_t id = 1; id <= size.anchors; ++id) {
      const bool first = (id - 1) % ((size.anchors + size.sessions - 1) / size.sessions) == 0;
      map.anchors[id] = savedAnchor(id, first ? 0 : id - 1, map);
      map.anchors[id].held_fast = first;
    }
    mapping::EdgeId next = 1;
    for (const auto& [id, saved] : map.anchors) {
      const mapping::AnchorId previous = saved.anchor.previous;
      if (previous != 0) map.edges[next++] = edge(previous, id, mapping::EdgeKind::kOdometry);
    }
    while (map.edges.size() < size.edges) {
      const std::uint64_t a = 1 + random_() % (size.anchors - 1);
      const std::uint64_t b = a + 1 + random_() % (size.anchors - a);
      map.edges[next++] = edge(a, b, mapping::EdgeKind::kLoop);
    }
    for (ObjectId id = 1; id <= size.records; ++id) map.records[id] = record(id, map);
    for (ObjectId id = 1; id <= size.shared; ++id) share(id, map);
    for (std::uint64_t id = 1; id <= std::min(size.views, size.anchors); ++id) {
      map.views[id] = view(1 + random_() % mapping::kMostPoints);
    }
    return map;
  }

  mapping::View view(std::size_t points) {
    mapping::View view(points);
    for (mapping::SeenPoint& point : view) {
      point.p = vector<3>().cast<float>();
      point.sigma = static_cast<float>(std::abs(number()));
      for (auto& byte : point.descriptor) byte = static_cast<std::uint8_t>(random_());
    }
    return view;
  }

  mapping::LevelPose pose() {
    mapping::LevelPose pose;
    pose.p = vector<3>();
    pose.yaw = random_() % 8 == 0 ? -0.0 : number();
    return pose;
  }

  mapping::Anchor anchor(mapping::AnchorId id, mapping::AnchorId previous) {
    mapping::Anchor anchor;
    anchor.id = id;
    anchor.previous = previous;
    anchor.session = {random_(), static_cast<std::uint32_t>(random_())};
    anchor.stamp = {~std::uint64_t{random_()}, random_(), time(), -whole()};
    anchor.T_WA = {Eigen::Quaterniond(Eigen::Vector4d(vector<4>())), vector<3>()};
    anchor.from_previous = gaussian();
    anchor.way_m = number();
    return anchor;
  }

  mapping::SavedEdge edge(mapping::AnchorId a, mapping::AnchorId b, mapping::EdgeKind kind) {
    return {{a, b, gaussian(), kind}, std::uniform_real_distribution<double>(0, 1)(random_)};
  }

  mapping::ObjectRecord record(ObjectId id, const mapping::SavedMap& map) {
    mapping::ObjectRecord record;
    record.session = map.anchors.begin()->second.anchor.session;
    record.way_m = number();
    record.last_seen = time();
    record.pose_error = matrix<6>();
    record.sighting = sighting(id, map);
    if (random_() % 3 == 0) record.earlier = sighting(id, map);
    record.confirmed = true;
    return record;
  }

  mapping::ObjectRecord trackRecord(TrackId id, const mapping::SavedMap& map) {
    mapping::ObjectRecord record = this->record(id, map);
    record.confirmed = random_() % 2 == 0;
    record.gone = random_() % 4 == 0;
    return record;
  }

 private:
  /// The object gets a second track, from the newest loop closure or from the filter.
  void share(ObjectId id, mapping::SavedMap& map) {
    const TrackId other = 1000 + id;
    map.tracks[id] = trackRecord(id, map);
    map.tracks[other] = trackRecord(other, map);
    map.facts.insert({random_() % 4 == 0 ? 0 : map.edges.rbegin()->first, id, other});
  }
  mapping::SavedAnchor savedAnchor(mapping::AnchorId id, mapping::AnchorId previous,
                                   const mapping::SavedMap& map) {
    mapping::SavedAnchor saved{anchor(id, previous), pose(), false};
    if (previous != 0) saved.anchor.session = map.anchors.at(previous).anchor.session;
    return saved;
  }
  mapping::Sighting sighting(ObjectId id, const mapping::SavedMap& map) {
    mapping::Sighting sighting;
    sighting.anchor = 1 + random_() % map.anchors.size();
    sighting.in_anchor.id = id;
    sighting.in_anchor.p = vector<3>();
    sighting.in_anchor.yaw = number();
    sighting.in_anchor.covariance = matrix<4>();
    for (std::uint32_t n = 0; n <= random_() % map.classes.size(); ++n) {
      sighting.in_anchor.pmf.push_back({n, number()});
    }
    return sighting;
  }
  mapping::LevelGaussian gaussian() { return {pose(), matrix<4>()}; }
  double number() { return 100.0 * normal_(random_); }
  std::int64_t whole() { return static_cast<std::int64_t>(random_()); }
  TimePoint time() { return fromNanoseconds(whole() * 1'000'003); }
  template <int N>
  Eigen::Matrix<double, N, 1> vector() {
    return Eigen::Matrix<double, N, 1>::NullaryExpr([this] { return number(); });
  }
  template <int N>
  Eigen::Matrix<double, N, N> matrix() {
    return Eigen::Matrix<double, N, N>::NullaryExpr([this] { return number(); });
  }

  std::mt19937 random_;
  std::normal_distribution<double> normal_;
};

inline void putBits(ByteWriter& out, const mapping::SavedAnchor& saved) {
  out(saved.T_MA.p);
  out(saved.T_MA.yaw);
  out(saved.held_fast);
}

/// All bits of a map, in an order that depends only on its contents.
inline std::string bitsOf(const mapping::SavedMap& map) {
  ByteWriter out;
  std::string bits;
  const auto add = [&](const Bytes& bytes) { bits.append(bytes.begin(), bytes.end()); };
  for (const auto& name : map.classes) out(name);
  for (const auto& [id, saved] : map.anchors) {
    out(id);
    putBits(out, saved);
    add(encodeAnchor(saved.anchor));
  }
  for (const auto& [id, saved] : map.edges) {
    out(id);
    out(saved.weight);
    add(encodeEdge(saved.edge));
  }
  for (const auto& [id, record] : map.records) {
    out(id);
    out(record.confirmed);
    add(encodeRecord(record));
  }
  for (const auto& [id, record] : map.tracks) {
    out(id);
    out(record.confirmed);
    out(record.gone);
    add(encodeRecord(record));
  }
  for (const mapping::SameObject& fact : map.facts) {
    out(fact.loop);
    out(fact.a);
    out(fact.b);
  }
  for (const auto& [anchor, view] : map.views) {
    out(anchor);
    add(encodeView(view));
  }
  add(out.take());
  return bits;
}

}  // namespace perdure::map_store::test
