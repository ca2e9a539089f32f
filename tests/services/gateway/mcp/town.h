// A map in memory: two cars, a van and a gone bicycle beside a straight road, with its anchors.
#pragma once

#include <cmath>

#include "services/gateway/mcp/map.h"
#include "tests/services/gateway/objects.h"

namespace perdure::gateway::test {

inline TimePoint at(double seconds) { return TimePoint(durationFromSeconds(seconds)); }

/// An object with an existence of 0.9 that its ledger explains. Its last evidence is a miss at 25
/// s.
inline ObjectBelief known(ObjectId id, const std::string& class_name, const Eigen::Vector3d& p) {
  ObjectBelief object = objectAt(id, p, class_name);
  object.existence = 0.9;
  object.classes.front().covariance = 0.01 * Matrix7d::Identity();
  object.why.existence.assign(kExistenceEvidences, {});
  const auto entry = [&](ExistenceEvidence kind) -> LedgerEntry& {
    return object.why.existence[static_cast<std::size_t>(kind)];
  };
  entry(ExistenceEvidence::kPrior) = {-1.0, 1, at(10), at(10)};
  entry(ExistenceEvidence::kHit) = {std::log(9.0) + 1.5, 4, at(10), at(20)};
  entry(ExistenceEvidence::kMiss) = {-0.5, 1, at(25), at(25)};
  object.first_seen = at(10);
  object.last_seen = at(20);
  object.seen_from[0] = 20.0F;
  return object;
}

class Town : public mcp::Map {
 public:
  Town() {
    state.now = at(100);
    state.cameras = {{0.0, 0.7}};
    state.ended.push_back({EventKind::kGone, at(90), 0, known(4, "bicycle", {30, -5, 0})});
    state.ended.push_back({EventKind::kMerged, at(95), 1, known(5, "car", {10, 5, 0})});
    beliefs = {known(1, "car", {10, 5, 0}), known(2, "car", {40, 5, 0}),
               known(3, "van", {25, -6, 0})};
    beliefs[1].first_seen = at(60);
    beliefs[1].last_seen = at(80);
    for (AnchorNumber id = 1; id <= 5; ++id) {
      MapAnchor anchor;
      anchor.id = id;
      anchor.p.x() = 12.0 * static_cast<double>(id - 1);
      anchors.push_back(anchor);
    }
  }
  mcp::State begin() override { return state; }
  MapReply ask(const MapQuery& query) override {
    MapReply reply;
    if (query.kind == MapQueryKind::kGraph) reply.anchors = anchors;
    for (const ObjectBelief& belief : beliefs) {
      const Eigen::Vector3d p = belief.best().mean.head<3>();
      const bool in_box =
          (p.array() >= query.low.array()).all() && (p.array() <= query.high.array()).all();
      const bool asked =
          query.kind == MapQueryKind::kAll || query.kind == MapQueryKind::kByRadius ||
          (query.kind == MapQueryKind::kById && query.object_id == belief.id) ||
          (query.kind == MapQueryKind::kByClass && query.class_name == belief.best().name) ||
          (query.kind == MapQueryKind::kByBox && in_box);
      if (!asked) continue;
      reply.objects.push_back(rowOf(belief));
      if (query.kind == MapQueryKind::kById) reply.beliefs.push_back(belief);
    }
    return reply;
  }

  bool takesCorrections() const override { return takes_corrections; }
  Correction correct(const Correction& correction) override {
    Correction made = correction;
    if (made.id == 0) made.id = 3;
    if (made.object == 0) made.object = 1;  // the withdrawn one is about it
    if (made.withdrawn) return made;
    for (ObjectBelief& belief : beliefs) perdure::correct({{made.object, {made}}}, belief);
    return made;
  }

  bool takes_corrections = false;
  mcp::State state;
  std::vector<ObjectBelief> beliefs;
  std::vector<MapAnchor> anchors;
};

}  // namespace perdure::gateway::test
