#include "common/mapping/fusion/united_map.h"

#include <algorithm>
#include <utility>

#include "common/mapping/fusion/provenance.h"
#include "common/mapping/fusion/united_sessions.h"

namespace perdure::mapping {
namespace {

class Uniting {
 public:
  Uniting(MapContents& map, const MapContents& other)
      : map_(map),
        other_(other),
        sessions_(map, other, addition_),
        theirs_(other),
        ours_(map),
        next_id_(std::max(map.largestId(), other.largestId()) + 1) {}

  Addition run() {
    matchObjects();
    for (const auto& [theirs, object] : other_.objects) addIfNew(theirs, object);
    for (const auto& [theirs, object] : other_.objects) tellIfNew(theirs);
    for (const auto& [theirs, object] : other_.objects) renew(theirs, object);
    addChanges();
    addCorrections();
    map_.origins = ours_.told();
    return std::move(addition_);
  }

 private:
  const ObjectRecord* recordOf(ObjectId id) const {
    const auto at = map_.graph.records.find(id);
    return at == map_.graph.records.end() ? nullptr : &at->second;
  }

  /// Returns whether an object of the other map may be the object `id`. Ids assigned after two maps
  /// diverged belong to different objects, even if their origins are equal. If the session of a
  /// last sighting is unknown, they may be one object.
  bool mayBeOne(ObjectId theirs, ObjectId id) const {
    const auto record = sessions_.recordOf(theirs, theirs);
    const ObjectRecord* known = recordOf(survivorOf(map_, id));
    return !record || !known || sessions_.wasSeenInBoth(*record) || sessions_.wasSeenInBoth(*known);
  }

  /// Returns the id in this map of an object of the other map; 0 if it is new.
  ObjectId knownAs(ObjectId theirs) const {
    const Known by_name = ours_.find(theirs_.nameOf(theirs));
    if (by_name.id != 0 && mayBeOne(theirs, by_name.id)) return by_name.id;
    for (const Origin& origin : theirs_.of(theirs)) {
      const Known known = ours_.find(origin);
      if (known.id != 0 && (known.told || mayBeOne(theirs, known.id))) return known.id;
    }
    return 0;
  }

  void matchObjects() {
    std::set<ObjectId> taken_ids;
    for (const auto& [theirs, object] : other_.objects) {
      ObjectId id = knownAs(theirs);
      if (id == 0) {
        id = theirs;
        if (map_.objects.contains(id) || taken_ids.contains(id)) id = next_id_++;
        taken_ids.insert(id);
        addition_.objects.insert(id);
      }
      id_of_[theirs] = id;
    }
  }

  StoredObject inOurIds(const StoredObject& object, ObjectId id) {
    StoredObject taken = object;
    taken.belief.id = id;
    taken.world = sessions_.worldOf(object.world);
    const auto ofOurs = [&](ObjectId theirs) {
      const auto at = id_of_.find(theirs);
      return at == id_of_.end() ? ObjectId{0} : at->second;
    };
    taken.belief.blocked_by = ofOurs(object.belief.blocked_by);
    if (taken.ended) taken.ended->merged_into = ofOurs(object.ended->merged_into);
    return taken;
  }

  void addIfNew(ObjectId theirs, const StoredObject& object) {
    const ObjectId id = id_of_.at(theirs);
    if (!addition_.objects.contains(id)) return;
    map_.objects[id] = inOurIds(object, id);
    auto record = sessions_.recordOf(theirs, id);
    if (record && !object.ended) map_.graph.records[id] = std::move(*record);
  }

  void tellIfNew(ObjectId theirs) {
    const ObjectId id = id_of_.at(theirs);
    if (!addition_.objects.contains(id)) return;
    auto all = theirs_.toldOf(theirs);
    all.push_back(theirs_.nameOf(theirs));
    for (Origin& origin : all) {
      origin.now = id;
      ours_.add(origin);
    }
  }

  /// Returns whether the other map merged the object into one that is the same object here.
  bool isHere(const Ending& ending, ObjectId id) const {
    const auto into = id_of_.find(ending.merged_into);
    return into != id_of_.end() && survivorOf(map_, into->second) == id;
  }

  void renew(ObjectId theirs, const StoredObject& object) {
    const ObjectId same = id_of_.at(theirs), id = survivorOf(map_, same);
    if (addition_.objects.contains(same) || (object.ended && map_.objects.at(same).ended)) return;
    std::vector<Origin> more = theirs_.of(theirs);
    std::erase_if(more, [&](const Origin& origin) { return ours_.covers(id, origin); });
    const StoredObject& before = map_.objects.at(id);
    const bool ended_since = object.ended && !before.ended && !isHere(*object.ended, id);
    if (more.empty() && !ended_since) return;
    Renewed renewed{id, before, inOurIds(object, id), std::nullopt, std::nullopt, false};
    renewed.record_now = sessions_.recordOf(theirs, id);
    if (const ObjectRecord* known = recordOf(id)) renewed.record_before = *known;
    renewed.shared = knowsMore(id, theirs);
    addition_.renewed.push_back(std::move(renewed));
    ours_.tell(id);
    for (Origin& origin : more) {
      origin.now = id;
      ours_.add(origin);
    }
  }

  /// Returns whether this map has evidence of the object that the other map lacks.
  bool knowsMore(ObjectId id, ObjectId theirs) const {
    const auto all = ours_.of(id);
    return std::any_of(all.begin(), all.end(),
                       [&](const Origin& origin) { return !theirs_.covers(theirs, origin); });
  }

  void addChanges() {
    for (Change change : other_.changes) {
      const auto at = id_of_.find(change.id);
      if (at == id_of_.end()) continue;
      change.id = at->second;
      change.by = sessions_.worldOf(change.by);
      change.map = sessions_.worldOf(change.map);
      const auto same = [&](const Change& known) {
        return known.id == change.id && known.kind == change.kind && known.since == change.since;
      };
      if (std::none_of(map_.changes.begin(), map_.changes.end(), same)) {
        map_.changes.push_back(change);
      }
    }
  }

  /// Adds the corrections, with new ids. A correction that both maps have stays withdrawn if one of
  /// them withdrew it. Standing ones beyond kMostCorrections are left out.
  void addCorrections() {
    std::vector<Correction>& ours = map_.graph.corrections;
    const auto ofOurs = [&](ObjectId theirs) {
      const auto at = id_of_.find(theirs);
      return survivorOf(map_, at == id_of_.end() ? theirs : at->second);
    };
    for (Correction each : other_.graph.corrections) {
      each.object = ofOurs(each.object);
      each.other = ofOurs(each.other);
      if (each.aboutTwo() && each.object == each.other) continue;
      const auto known = std::ranges::find_if(ours, [&](Correction one) {
        one.object = survivorOf(map_, one.object);
        one.other = survivorOf(map_, one.other);
        one.id = each.id;
        one.withdrawn = each.withdrawn;
        return one == each;
      });
      if (known != ours.end()) {
        known->withdrawn = known->withdrawn || each.withdrawn;
        continue;
      }
      const auto standing = std::ranges::count(ours, false, &Correction::withdrawn);
      if (!each.withdrawn && std::cmp_greater_equal(standing, kMostCorrections)) {
        ++addition_.corrections_left_out;
        continue;
      }
      each.id = ours.empty() ? 1 : ours.back().id + 1;
      ours.push_back(std::move(each));
    }
  }

  MapContents& map_;
  const MapContents& other_;
  Addition addition_;
  UnitedSessions sessions_;
  const Provenance theirs_;
  Provenance ours_;
  ObjectId next_id_;
  std::map<ObjectId, ObjectId> id_of_;
};

}  // namespace

Addition unite(MapContents& map, const MapContents& other) { return Uniting(map, other).run(); }

}  // namespace perdure::mapping
