#include "common/mapping/fusion/object_fusion.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "common/mapping/frames/level_errors.h"
#include "common/mapping/fusion/belief_fusion.h"
#include "common/mapping/fusion/provenance.h"
#include "common/mapping/fusion/relations.h"
#include "common/mapping/fusion/sightings.h"

namespace perdure::mapping {
namespace {

void putOutOfSight(ObjectBelief& belief) {
  belief.visibility = Visibility::kOutOfView;
  belief.visible_fraction = 0.0;
  belief.memory = Memory::kLongTerm;
}

void end(MapContents& map, ObjectId id, const Ending& ending) {
  StoredObject& object = map.objects.at(id);
  object.ended = ending;
  putOutOfSight(object.belief);
  map.graph.records.erase(id);
}

Witness witness(const MapContents& map, const StoredObject& object, const ObjectRecord& record) {
  return {object.belief, record, map.graph.anchors.at(record.sighting.anchor).anchor};
}

class Renewal {
 public:
  explicit Renewal(MapContents& map)
      : map_(map), places_(map.graph), relations_(places_.state().graph()) {}

  std::vector<Change> run(const Addition& addition) {
    for (const Renewed& each : addition.renewed) {
      // An object that the other map has merged or lost ends here too.
      if (each.now.ended) {
        endAsTheySay(each);
      } else {
        take(each);
      }
    }
    return std::move(changes_);
  }

 private:
  /// Ends an object that ended in the other map. An object stays if this map has other evidence of
  /// it and observed it after that end, or if both maps merged it into the same object.
  void endAsTheySay(const Renewed& each) {
    const Ending& ending = *each.now.ended;
    const StoredObject& before = each.before;
    if (before.ended || (each.shared && before.belief.last_seen > ending.time)) return;
    if (ending.kind == EventKind::kMerged && survivorOf(map_, ending.merged_into) == each.id)
      return;
    if (ending.kind == EventKind::kGone && each.record_before) {
      tell(each, Change::Kind::kGone, ending.time, each.now.world);
    }
    if (!each.shared) {
      map_.objects.at(each.id).belief = each.now.belief;
      map_.objects.at(each.id).world = each.now.world;
    }
    end(map_, each.id, ending);
  }

  void tell(const Renewed& each, Change::Kind kind, TimePoint since, const WorldId& by) {
    const PlacesInM::Place at = places_.of(*each.record_before);
    changes_.push_back({kind, each.id, each.before.belief.best().name, at.map, at.p,
                        each.before.belief.last_seen, since, by});
  }

  void take(const Renewed& each) {
    const auto& gone = each.before.ended;
    if (gone && each.now.belief.last_seen <= gone->time) return;
    StoredObject taken = each.now;
    taken.belief.id = each.id;
    const bool moved = hasMoved(each);
    if (moved) {
      tell(each, Change::Kind::kMoved, each.now.belief.last_seen, each.record_now->session);
    }
    if (each.shared && !moved) taken = fusedWithBefore(each);
    putOutOfSight(taken.belief);
    if (auto record = recordOf(each)) map_.graph.records[each.id] = std::move(*record);
    map_.objects[each.id] = std::move(taken);
  }

  /// Returns the other map's record. If this map's record is of another session, its sighting
  /// becomes `earlier`.
  std::optional<ObjectRecord> recordOf(const Renewed& each) const {
    if (!each.record_now) return each.record_before;
    ObjectRecord record = *each.record_now;
    if (each.record_before && each.record_before->session != record.session) {
      record.earlier = each.record_before->sighting;
      record.earlier->in_anchor.id = each.id;
    }
    return record;
  }

  /// Returns whether the object moved between two drives. Within one drive the filter tracks
  /// motion.
  bool hasMoved(const Renewed& each) {
    if (!each.record_before || !each.record_now) return false;
    if (each.record_before->session == each.record_now->session) return false;
    const auto T_ab =
        relations_.between(each.record_before->sighting.anchor, each.record_now->sighting.anchor);
    if (!T_ab) return false;
    constexpr double kFar_m = 2.0, kSigmas = 4.0;
    const PlacedObject& was = each.record_before->sighting.in_anchor;
    const PlacedObject is = laid(*T_ab, each.record_now->sighting.in_anchor);
    const double far_m = (is.p - was.p).head<2>().norm();
    return far_m > kFar_m && far_m > kSigmas * planeSigma(was.covariance + is.covariance);
  }

  /// Fuses the two beliefs. If their relative pose is unknown, returns the other map's belief. The
  /// origins of the lost belief remain, because they identify the object in later fusions.
  StoredObject fusedWithBefore(const Renewed& each) {
    if (!each.record_before || !each.record_now) return each.now;
    const auto T_ab =
        relations_.between(each.record_now->sighting.anchor, each.record_before->sighting.anchor);
    if (!T_ab) return each.now;
    StoredObject result = each.now;
    result.belief = fusedAcross(witness(map_, each.now, *each.record_now),
                                witness(map_, each.before, *each.record_before), *T_ab);
    return result;
  }

  MapContents& map_;
  PlacesInM places_;
  Relations relations_;
  std::vector<Change> changes_;
};

class Joining {
 public:
  Joining(MapContents& map, const std::map<ObjectId, ObjectRecord>& before, const PoseGraph& graph)
      : map_(map), before_(before), relations_(graph), provenance_(map) {}
  ~Joining() { map_.origins = provenance_.told(); }

  void join(const std::vector<ObjectId>& group) {
    const ObjectId survivor = group.front();
    const auto final_record = map_.graph.records.find(survivor);
    if (final_record == map_.graph.records.end()) return;
    const ObjectId host = hostOf(group, final_record->second);
    StoredObject result = map_.objects.at(host);
    for (const ObjectId guest : group) {
      if (guest != host) fuse(result, host, guest);
    }
    for (const ObjectId id : group) provenance_.tell(id);
    result.belief.id = survivor;
    putOutOfSight(result.belief);
    for (const ObjectId id : group) {
      if (id == survivor) continue;
      const TimePoint last = map_.objects.at(id).belief.last_seen;
      end(map_, id, {EventKind::kMerged, last, survivor});
    }
    map_.objects[survivor] = std::move(result);
  }

 private:
  /// Returns the object of the group that has the sighting of the common record, because the fused
  /// belief must be in the W of that sighting.
  ObjectId hostOf(const std::vector<ObjectId>& group, const ObjectRecord& record) const {
    for (const ObjectId id : group) {
      const auto at = before_.find(id);
      if (at == before_.end()) continue;
      const ObjectRecord& mine = at->second;
      if (mine.session == record.session && mine.way_m == record.way_m &&
          mine.sighting.anchor == record.sighting.anchor &&
          mine.sighting.in_anchor.p == record.sighting.in_anchor.p) {
        return id;
      }
    }
    return group.front();
  }

  void fuse(StoredObject& result, ObjectId host, ObjectId guest) {
    const auto of_host = before_.find(host), of_guest = before_.find(guest);
    if (of_host == before_.end() || of_guest == before_.end()) return;
    const auto T =
        relations_.between(of_host->second.sighting.anchor, of_guest->second.sighting.anchor);
    if (!T) return;
    result.belief = fusedAcross(witness(map_, result, of_host->second),
                                witness(map_, map_.objects.at(guest), of_guest->second), *T);
  }

  MapContents& map_;
  const std::map<ObjectId, ObjectRecord>& before_;
  Relations relations_;
  Provenance provenance_;
};

}  // namespace

std::vector<Change> renew(MapContents& map, const Addition& addition) {
  if (addition.renewed.empty()) return {};
  return Renewal(map).run(addition);
}

std::size_t mergeObjects(MapContents& map, const std::map<ObjectId, ObjectRecord>& before,
                         const Identity& identity, const PoseGraph& graph) {
  Joining joining(map, before, graph);
  std::size_t count = 0;
  for (const auto& [object, tracks] : identity.shared()) {
    std::vector<ObjectId> group;
    std::copy_if(tracks.begin(), tracks.end(), std::back_inserter(group),
                 [&](ObjectId id) { return map.objects.contains(id); });
    if (group.size() < 2) continue;
    joining.join(group);
    count += group.size() - 1;
  }
  return count;
}

}  // namespace perdure::mapping
