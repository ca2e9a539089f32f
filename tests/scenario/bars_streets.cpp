// Bars of row, roll, traffic and street.
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "common/math/so3.h"
#include "tests/scenario/bars.h"

namespace perdure::test {
namespace {

constexpr double kDegree = M_PI / 180.0;

/// Returns the roll of the camera in radians.
double rollOf(const RigidTransform& T_WC) {
  const Eigen::Vector3d right = T_WC.R().col(0), forward = T_WC.R().col(2);
  const Eigen::Vector3d level = forward.cross(Eigen::Vector3d::UnitZ()).normalized();
  return std::acos(std::clamp(std::abs(right.dot(level)), 0.0, 1.0));
}

/// Change of an estimate between two frames.
struct Change {
  double yaw = 0.0, size = 0.0;  ///< rad; relative
};

Change changeBetween(const Glance& a, const Glance& b) {
  return {std::abs(wrapAngle(b.yaw - a.yaw)),
          (b.size.cwiseQuotient(a.size) - Eigen::Vector3d::Ones()).cwiseAbs().maxCoeff()};
}

/// Returns the changes of estimates during a roll of `least` or more, from the last level frame to
/// the frame with the largest roll. Counts objects in view that are confirmed, settled (20 hits)
/// and standing.
std::vector<Change> changesByRoll(const Outcome& run, double least) {
  std::vector<Change> changes;
  std::map<ObjectId, const Glance*> level;
  std::map<ObjectId, std::pair<double, Change>> leaning;
  const auto finish = [&] {
    for (const auto& [id, one] : leaning) changes.push_back(one.second);
    leaning.clear();
  };
  for (const JournalFrame& f : run.journal.frames) {
    const double roll = rollOf(f.T_WB * run.truth.camera.T_BC());
    if (roll < 3.0 * kDegree) finish(), level.clear();
    for (const Glance& g : f.objects) {
      if (!g.in_sight || !g.confirmed || g.hits < 20 || g.moving > 0.5) continue;
      if (roll < 3.0 * kDegree) level[g.id] = &g;
      const auto before = level.find(g.id);
      if (before == level.end() || roll < least) continue;
      auto& most = leaning[g.id];
      if (roll > most.first) most = {roll, changeBetween(*before->second, g)};
    }
  }
  finish();
  return changes;
}

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0.0;
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1) + 0.5)];
}

/// Returns the distance from a place to the nearest true object that always stands there.
double toNearestStanding(const Outcome& run, const Eigen::Vector3d& place) {
  double nearest = 1e9;
  for (const auto& one : run.truth.truth.objects) {
    if (one.moves || one.keys.size() != 1) continue;
    nearest = std::min(nearest, (one.keys[0].centre_W - place).norm());
  }
  return nearest;
}

double toNearestAtEnd(const Outcome& run, const Eigen::Vector3d& place) {
  double nearest = toNearestStanding(run, place);
  for (const auto& one : run.truth.truth.objects) {
    if (!one.presentAt(run.truth.frames.back())) continue;
    nearest = std::min(nearest, (one.at(run.truth.frames.back()).centre_W - place).norm());
  }
  return nearest;
}

/// Returns the share of parked objects in the long-term memory. Counts objects that were reported
/// in ten frames and are now outside the working set's range.
double rememberedShare(const Outcome& run) {
  const Eigen::Vector3d here = run.truth.body.poses().back().T_WB.p;
  double left = 0.0, kept = 0.0;
  for (const auto& object : run.truth.truth.objects) {
    if (object.moves || object.keys.size() != 1) continue;
    const Eigen::Vector3d place = object.keys[0].centre_W;
    if ((place - here).norm() < 90.0) continue;
    const auto claims = std::count_if(run.inst_rows.begin(), run.inst_rows.end(), [&](auto& row) {
      return row.class_name == object.class_name && (row.centre_W - place).norm() < 1.0;
    });
    if (claims < 10) continue;
    left += 1.0;
    const bool there = std::any_of(run.objects.begin(), run.objects.end(), [&](const auto& o) {
      return !o.working && (o.centre - place).norm() < 1.5;
    });
    kept += there ? 1.0 : 0.0;
  }
  return left > 0.0 ? kept / left : 0.0;
}

/// Returns the car that stands for twenty seconds and then drives off ahead of the body.
const sim::TruthObject* whatDrivesOff(const Outcome& run) {
  const TimePoint start = run.truth.frames.front();
  for (const auto& object : run.truth.truth.objects) {
    if (!object.moves || object.class_name != "car" || !object.presentAt(start)) continue;
    const Eigen::Vector3d early = object.at(start).centre_W;
    const Eigen::Vector3d later = object.at(start + std::chrono::seconds(20)).centre_W;
    const Eigen::Vector3d end = object.at(run.truth.frames.back()).centre_W;
    if ((early - later).norm() < 0.05 && end.x() > early.x() + 5.0) return &object;
  }
  return nullptr;
}

/// Counts the `moved` events of objects that are then estimated near the true object.
double movedEvents(const Outcome& run, const sim::TruthObject& object) {
  constexpr double kNear = 2.0;  // metres
  double count = 0.0;
  for (const auto& event : run.events) {
    if (event["event"] != "moved") continue;
    for (const auto& [frame, glance] : run.journal.of(event["object_id"].get<std::uint64_t>())) {
      if (frame->frame != event["frame"].get<std::uint64_t>()) continue;
      if ((glance->centre - object.at(frame->time).centre_W).norm() < kNear) count += 1.0;
    }
  }
  return count;
}

/// Returns the share of the objects that kept their id.
double keptIds(const Outcome& run) {
  const auto claimed = idsByHalf(run);
  const auto kept = std::count_if(claimed.begin(), claimed.end(),
                                  [](const IdsByHalf& ids) { return ids.first == ids.second; });
  return claimed.empty() ? 0.0 : static_cast<double>(kept) / number(claimed.size());
}

/// Counts interruptions of the confirmation of fully visible objects.
double flicker(const Outcome& run) {
  double toggles = 0.0;
  std::map<ObjectId, bool> lost;  // whether an id was lost, for objects that were confirmed in view
  for (const JournalFrame& f : run.journal.frames) {
    for (const Glance& g : f.objects) {
      if (g.visibility != Visibility::kVisible) {
        lost.erase(g.id);
      } else if (const auto it = lost.find(g.id); g.confirmed) {
        if (it != lost.end() && it->second) toggles += 1.0;
        lost[g.id] = false;
      } else if (it != lost.end()) {
        it->second = true;
      }
    }
  }
  return toggles;
}

/// Counts objects that were confirmed at rest and were estimated metres away one frame later.
double jumps(const Outcome& run) {
  constexpr double kFar = 3.0;  // metres
  double count = 0.0;
  std::map<ObjectId, Eigen::Vector3d> claimed;
  for (const JournalFrame& f : run.journal.frames) {
    std::map<ObjectId, Eigen::Vector3d> now;
    for (const Glance& g : f.objects) {
      const auto before = claimed.find(g.id);
      if (before != claimed.end() && (g.centre - before->second).norm() > kFar) count += 1.0;
      if (g.confirmed && g.moving < 0.5) now.emplace(g.id, g.centre);
    }
    claimed = std::move(now);
  }
  return count;
}

}  // namespace

std::vector<IdsByHalf> idsByHalf(const Outcome& run) {
  const std::uint64_t all = run.truth.frames.size();
  std::vector<IdsByHalf> result;
  for (const auto& object : run.truth.truth.objects) {
    if (object.moves || object.keys.size() != 1) continue;
    const Eigen::Vector3d place = object.keys[0].centre_W;
    const auto first = mostClaimed(run.inst_rows, place, 1.0, "", 0, all / 2);
    const auto second = mostClaimed(run.inst_rows, place, 1.0, "", all / 2, all);
    if (first != 0 && second != 0) result.push_back({&object, first, second});
  }
  return result;
}

Bars rowBars(const Outcome& run) {
  double within = 0.0, doubled = 0.0;
  for (const auto& car : run.standing("car")) {
    const Eigen::Vector3d& place = car.keys[0].centre_W;
    within += run.countNear(place, 0.5, "car") > 0 ? 1.0 : 0.0;
    doubled += run.countNear(place, 1.2, "car") > 1 ? 1.0 : 0.0;
  }
  return {atMost(0, "switches of id", number(run.inst.id_switches)),
          atMost(0, "cars that are on the map twice at the end", doubled),
          atLeast(10, "cars of the row that are on the map within 0.5 m", within)};
}

Bars rollBars(const Outcome& run) {
  const auto changes = changesByRoll(run, 50.0 * kDegree);
  std::vector<double> yaws, sizes;
  for (const Change& c : changes) yaws.push_back(c.yaw / kDegree), sizes.push_back(c.size);
  return {
      atLeast(5, "settled objects in view of a level camera until it leans by 50 deg and more",
              number(changes.size())),
      atMost(5.0, "change of yaw meanwhile, deg, median", quantile(yaws, 0.5)),
      atMost(5.0, "change of yaw meanwhile, deg, nine in ten", quantile(yaws, 0.9)),
      atMost(0.05, "change of a length, width or height, share, median", quantile(sizes, 0.5)),
      atMost(0.05, "change of a length, width or height, share, nine in ten", quantile(sizes, 0.9)),
      atMost(0.5, "mean position error of what is found under 1 m",
             run.final.cells[1][2].positionError())};
}

std::vector<MapObject> ghosts(const Outcome& run) {
  std::vector<MapObject> result;
  for (const auto& object : run.believed()) {
    if (object.moving < 0.5 && toNearestAtEnd(run, object.centre) > 3.0) result.push_back(object);
  }
  return result;
}

std::map<const sim::TruthObject*, std::size_t> foundNearest(const Outcome& run, ObjectId id) {
  std::map<const sim::TruthObject*, std::size_t> times;
  std::uint32_t hits = 0;
  for (const auto& [frame, glance] : run.journal.of(id)) {
    if (glance->hits == std::exchange(hits, glance->hits)) continue;
    const sim::TruthObject* nearest = nullptr;
    double least = std::numeric_limits<double>::infinity();
    for (const auto& object : run.truth.truth.objects) {
      if (!object.presentAt(frame->time)) continue;
      const double apart = (object.at(frame->time).centre_W - glance->centre).norm();
      if (apart < least) least = apart, nearest = &object;
    }
    if (nearest != nullptr) ++times[nearest];
  }
  return times;
}

Bars trafficBars(const Outcome& run) {
  double kept = 0.0, kept_vehicles = 0.0;
  for (const auto& object : run.believed()) {
    if (object.working || toNearestStanding(run, object.centre) <= 3.0) continue;
    kept += 1.0;
    const auto found = foundNearest(run, object.id);
    const auto most =
        std::max_element(found.begin(), found.end(),
                         [](const auto& a, const auto& b) { return a.second < b.second; });
    const bool vehicle =
        most != found.end() && most->first->moves && most->first->class_name != "person";
    kept_vehicles += vehicle ? 1.0 : 0.0;
  }
  const sim::TruthObject* off = whatDrivesOff(run);
  return {
      atMost(0, "vehicles that drove, stored in the map where there is no object", kept_vehicles),
      atMost(0, "objects stored in the map where there is none", kept),
      onAverage(
          atLeast(0.95, "share of the parked ones left behind that it has", rememberedShare(run))),
      atLeast(1, "`moved` events of the parked car that drives off",
              off == nullptr ? 0.0 : movedEvents(run, *off)),
      atMost(0, "static objects on the map where there is none", number(ghosts(run).size()))};
}

Bars streetBars(const Outcome& run) {
  return {
      onAverage(atLeast(0.98, "second lap: share that keeps the id of the first", keptIds(run))),
      onAverage(atMost(1.02, "objects of the map for each one found", run.final.idsPerFound())),
      atMost(0, "switches of id, FINAL", number(run.final.id_switches)),
      atMost(0, "flicker: reports of a fully visible object that stop and resume", flicker(run)),
      atMost(0, "static positions that jump by more than 3 m in one frame", jumps(run))};
}

}  // namespace perdure::test
