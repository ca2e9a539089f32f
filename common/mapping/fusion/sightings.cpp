#include "common/mapping/fusion/sightings.h"

#include <utility>

#include "common/mapping/graph/components.h"
#include "common/mapping/places/map_index.h"

namespace perdure::mapping {
namespace {

/// Largest distance between positions of one object in two drives.
constexpr double kSamePlace_m = 1.5;

struct Standing {
  ObjectId id = 0;
  PlacesInM::Place place;
};

bool isGone(const StoredObject& object) {
  return object.ended && object.ended->kind == EventKind::kGone;
}

bool wasSeenIn(const WorldId& session, const ObjectRecord& record, const SavedMap& map) {
  const auto of = [&](const Sighting& sighting) {
    return map.anchors.at(sighting.anchor).anchor.session;
  };
  return record.session == session || of(record.sighting) == session ||
         (record.earlier && of(*record.earlier) == session);
}

std::vector<Standing> standing(const MapContents& map, const PlacesInM& places) {
  std::vector<Standing> all;
  for (const auto& [id, record] : map.graph.records) {
    const auto object = map.objects.find(id);
    if (object == map.objects.end() || object->second.ended) continue;
    all.push_back({id, places.of(record)});
  }
  return all;
}

std::vector<Eigen::Vector2d> inPlane(const std::vector<Standing>& all) {
  std::vector<Eigen::Vector2d> points;
  for (const Standing& each : all) points.emplace_back(each.place.p.head<2>());
  return points;
}

}  // namespace

PlacesInM::PlacesInM(const SavedMap& map)
    : state_(Parameters(), map), components_(componentsOf(state_.graph())) {
  for (const auto& [id, saved] : map.anchors) {
    ways_[saved.anchor.session][saved.anchor.stamp.time] = id;
  }
}

PlacesInM::Place PlacesInM::inM(AnchorId anchor, const Eigen::Vector3d& p_A) const {
  const AnchorId first = components_.at(anchor);
  return {state_.anchors().at(first).session, state_.graph().pose(anchor) * p_A, anchor};
}

PlacesInM::Place PlacesInM::of(const ObjectRecord& record) const {
  return inM(record.sighting.anchor, record.sighting.in_anchor.p);
}

std::optional<PlacesInM::Place> PlacesInM::of(const StoredObject& object) const {
  const auto way = ways_.find(object.world);
  if (way == ways_.end()) return std::nullopt;
  auto at = way->second.upper_bound(object.belief.last_seen);
  if (at != way->second.begin()) --at;
  const Eigen::Vector3d p_W = object.belief.best().mean.head<3>();
  return inM(at->second, state_.anchors().at(at->second).T_WA.inverse() * p_W);
}

namespace {

/// Finds objects of other drives at places where a later drive lost an object of the same class.
class Departures {
 public:
  explicit Departures(MapContents& map)
      : map_(map),
        places_(map.graph),
        standing_(standing(map, places_)),
        grid_(kSamePlace_m, inPlane(standing_)) {}

  std::vector<Change> run() {
    for (const auto& [id, gone] : map_.objects) {
      if (!isGone(gone)) continue;
      if (const Standing* left = leftBy(gone)) end(*left, gone);
    }
    return std::move(changes_);
  }

 private:
  /// Returns the nearest object of another drive at the place of `gone`, or null. Returns null if
  /// the drive of `gone` has another object of the class there, because `gone` was then a
  /// duplicate.
  const Standing* leftBy(const StoredObject& gone) const {
    const auto where = places_.of(gone);
    if (!where) return nullptr;
    const Standing* nearest = nullptr;
    double nearest_m = kSamePlace_m;
    bool stands = false;
    grid_.around(where->p.head<2>(), [&](std::size_t k) {
      const Standing& each = standing_[k];
      const StoredObject& object = map_.objects.at(each.id);
      const double distance = (each.place.p - where->p).norm();
      if (object.ended || each.place.map != where->map || distance >= kSamePlace_m) return;
      if (object.belief.best().name != gone.belief.best().name) return;
      if (wasSeenIn(gone.world, map_.graph.records.at(each.id), map_.graph)) {
        stands = true;
      } else if (distance < nearest_m) {
        nearest = &each;
        nearest_m = distance;
      }
    });
    const bool earlier =
        nearest && map_.objects.at(nearest->id).belief.last_seen < gone.ended->time;
    return !stands && earlier ? nearest : nullptr;
  }

  void end(const Standing& left, const StoredObject& gone) {
    StoredObject& object = map_.objects.at(left.id);
    changes_.push_back({Change::Kind::kGone, left.id, object.belief.best().name, left.place.map,
                        left.place.p, object.belief.last_seen, gone.ended->time, gone.world});
    object.ended = Ending{EventKind::kGone, gone.ended->time, 0};
    map_.graph.records.erase(left.id);
  }

  MapContents& map_;
  PlacesInM places_;
  std::vector<Standing> standing_;
  PlaceGrid grid_;
  std::vector<Change> changes_;
};

}  // namespace

std::vector<Change> endWhatIsGone(MapContents& map) { return Departures(map).run(); }

}  // namespace perdure::mapping
