#include "tools/evaluate/memory/visits.h"

#include <algorithm>

#include "tools/base/quantile.h"

namespace perdure::tools {
namespace {

using Counts = std::map<std::uint64_t, std::size_t>;

struct SeenObject {
  std::uint64_t id = 0;
  const std::string* class_name = nullptr;
  Eigen::Vector3d centre_B = Eigen::Vector3d::Zero();
};

double share(std::uint64_t part, std::uint64_t whole) {
  return whole == 0 ? 1.0 : static_cast<double>(part) / static_cast<double>(whole);
}

std::optional<std::uint64_t> mostOften(const Counts& counts) {
  const auto most = std::ranges::max_element(
      counts, [](const auto& a, const auto& b) { return a.second < b.second; });
  if (most == counts.end()) return std::nullopt;
  return most->first;
}

bool mayBeSeen(const sim::TruthObject& object) {
  return !object.moves && object.keys.size() == 1 && object.class_name != "toy";
}

using StandingObjects = std::map<std::uint64_t, const sim::TruthObject*>;

StandingObjects standingObjects(const SimulatedTruth& truth) {
  StandingObjects objects;
  for (const auto& object : truth.truth.objects) {
    if (mayBeSeen(object)) objects[object.id] = &object;
  }
  return objects;
}

std::vector<SeenObject> visibleIn(const SimulatedTruth& truth, const StandingObjects& objects,
                                  std::uint64_t frame, const RigidTransform& true_T_WB,
                                  const MemoryOptions& options) {
  std::vector<SeenObject> visible;
  const auto views = truth.truth.views.find(frame);
  if (views == truth.truth.views.end()) return visible;
  const RigidTransform T_BW = true_T_WB.inverse();
  for (const auto& view : views->second) {
    const auto object = objects.find(view.object_id);
    if (object == objects.end() || view.visible_fraction < options.least_seen) continue;
    const Eigen::Vector3d centre_B = T_BW * object->second->at(truth.frames[frame]).centre_W;
    if (centre_B.norm() > options.reach_m) continue;
    visible.push_back({view.object_id, &object->second->class_name, centre_B});
  }
  return visible;
}

std::vector<Sighting> matched(const std::vector<SeenObject>& visible,
                              const std::vector<const EstimateRow*>& rows,
                              const RigidTransform& T_WB, double near_m) {
  struct Pair {
    double distance = 0.0;
    std::size_t object = 0, row = 0;
  };
  std::vector<Pair> pairs;
  const RigidTransform T_BW = T_WB.inverse();
  for (std::size_t r = 0; r < rows.size(); ++r) {
    const Eigen::Vector3d centre_B = T_BW * rows[r]->centre_W;
    for (std::size_t o = 0; o < visible.size(); ++o) {
      const double distance = (centre_B - visible[o].centre_B).norm();
      if (rows[r]->class_name == *visible[o].class_name && distance < near_m)
        pairs.push_back({distance, o, r});
    }
  }
  std::ranges::stable_sort(pairs, {}, &Pair::distance);
  std::vector<Sighting> sightings;
  for (const auto& object : visible) sightings.push_back({object.id, std::nullopt});
  std::vector<bool> used(rows.size());
  for (const Pair& pair : pairs) {
    if (used[pair.row] || sightings[pair.object].id) continue;
    used[pair.row] = true;
    sightings[pair.object].id = rows[pair.row]->id;
  }
  return sightings;
}

/// Transforms a point from the ground truth's W to the run's W by the two poses of a frame.
Eigen::Vector3d inFrameOf(const MemoryFrame& frame, const Eigen::Vector3d& point_W) {
  return frame.T_WB * (frame.true_T_WB.inverse() * point_W);
}

void scoreSightings(const std::vector<MemoryFrame>& frames, MemoryScore& score) {
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const bool late = 2 * i >= frames.size();
    for (const auto& sighting : frames[i].sightings) {
      const std::uint64_t found = sighting.id ? 1 : 0;
      ++score.sightings;
      score.matched += found;
      score.late_sightings += late ? 1 : 0;
      score.late_matched += late ? found : 0;
    }
  }
}

void scoreIds(const std::vector<Visit>& visits, MemoryScore& score) {
  std::set<std::uint64_t> ids;
  std::vector<std::uint64_t> reported;  // main id of each visit
  for (const auto& visit : visits) {
    for (const auto& [id, times] : visit.ids) ids.insert(id);
    if (const auto id = visit.id()) reported.push_back(*id);
  }
  score.objects_matched += ids.empty() ? 0 : 1;
  score.ids += ids.size();
  score.with_more_ids += ids.size() > 1 ? 1 : 0;
  if (reported.size() < 2) return;
  ++score.reported_twice;
  score.kept += reported.front() == reported.back() ? 1 : 0;
}

std::map<std::uint64_t, std::uint64_t> lastIds(
    const std::map<std::uint64_t, std::vector<Visit>>& visits) {
  std::map<std::uint64_t, std::uint64_t> ids;
  for (const auto& [object, all] : visits) {
    for (const auto& visit : all) {
      if (const auto id = visit.id()) ids[object] = *id;
    }
  }
  return ids;
}

/// Returns, for each id, the object that it matched in most frames.
std::map<std::uint64_t, std::uint64_t> ownersOf(const std::vector<MemoryFrame>& frames) {
  std::map<std::uint64_t, Counts> times;
  for (const auto& frame : frames) {
    for (const auto& sighting : frame.sightings) {
      if (sighting.id) ++times[*sighting.id][sighting.object];
    }
  }
  std::map<std::uint64_t, std::uint64_t> owners;
  for (const auto& [id, counts] : times) owners[id] = *mostOften(counts);
  return owners;
}

std::set<std::uint64_t> idsOf(const std::vector<MemoryFrame>& frames) {
  std::set<std::uint64_t> ids;
  for (const auto& frame : frames) ids.insert(frame.reported.begin(), frame.reported.end());
  return ids;
}

/// Index of the first frame that reports an id of `known`; the number of frames if there is none.
std::size_t firstWith(const std::set<std::uint64_t>& known,
                      const std::vector<MemoryFrame>& frames) {
  const auto found = std::ranges::find_if(frames, [&](const MemoryFrame& frame) {
    return std::ranges::any_of(frame.reported,
                               [&](std::uint64_t id) { return known.contains(id); });
  });
  return static_cast<std::size_t>(found - frames.begin());
}

std::set<std::uint64_t> objectsIn(const std::vector<MemoryFrame>& frames, std::size_t end) {
  std::set<std::uint64_t> objects;
  for (std::size_t i = 0; i < std::min(end, frames.size()); ++i) {
    for (const auto& sighting : frames[i].sightings) objects.insert(sighting.object);
  }
  return objects;
}

}  // namespace

std::vector<MemoryFrame> besideTheBody(const SimulatedTruth& truth,
                                       const std::vector<EstimateRow>& rows,
                                       const std::vector<replay::StampedPose>& trajectory,
                                       const MemoryOptions& options) {
  const StandingObjects objects = standingObjects(truth);
  std::map<TimePoint, RigidTransform> pose_at;
  for (const auto& pose : trajectory) pose_at[pose.time] = pose.T_WB;
  std::map<std::uint64_t, std::vector<const EstimateRow*>> rows_of;
  for (const auto& row : rows) rows_of[row.frame].push_back(&row);
  std::vector<MemoryFrame> frames;
  for (std::uint64_t i = 0; i < truth.frames.size(); ++i) {
    const auto pose = pose_at.find(truth.frames[i]);
    const auto body = truth.body.at(i, truth.frames[i]);
    if (pose == pose_at.end() || !body) continue;
    MemoryFrame frame;
    frame.time = truth.frames[i];
    frame.T_WB = pose->second;
    frame.true_T_WB = *body;
    if (!frames.empty())
      frame.way_m = frames.back().way_m + (body->p - frames.back().true_T_WB.p).norm();
    frame.sightings = matched(visibleIn(truth, objects, i, *body, options), rows_of[i], frame.T_WB,
                              options.near_m);
    for (const auto* row : rows_of[i]) frame.reported.insert(row->id);
    frames.push_back(std::move(frame));
  }
  return frames;
}

std::optional<std::uint64_t> Visit::id() const { return mostOften(ids); }

std::map<std::uint64_t, std::vector<Visit>> visitsOf(const std::vector<MemoryFrame>& frames,
                                                     const MemoryOptions& options) {
  std::map<std::uint64_t, std::vector<Visit>> visits;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    for (const auto& sighting : frames[i].sightings) {
      auto& of_object = visits[sighting.object];
      const bool again = of_object.empty() ||
                         toSeconds(frames[i].time - frames[of_object.back().frames.back()].time) >=
                             options.apart_s;
      if (again) of_object.emplace_back();
      of_object.back().frames.push_back(i);
      if (sighting.id) ++of_object.back().ids[*sighting.id];
    }
  }
  return visits;
}

double MemoryScore::keptShare() const { return share(kept, reported_twice); }
double MemoryScore::recall() const { return share(matched, sightings); }
double MemoryScore::lateRecall() const { return share(late_matched, late_sightings); }
double MemoryScore::idsPerObject() const { return share(ids, objects_matched); }
double ReturnScore::keptShare() const { return share(kept, known); }

MemoryScore scoreMemory(const SimulatedTruth& truth, const std::vector<MemoryFrame>& frames,
                        const MemoryOptions& options) {
  const StandingObjects objects = standingObjects(truth);
  const auto visits = visitsOf(frames, options);
  MemoryScore score;
  score.frames = frames.size();
  score.objects = visits.size();
  scoreSightings(frames, score);
  std::vector<double> drifts;
  for (const auto& [object, of_object] : visits) {
    scoreIds(of_object, score);
    if (of_object.size() < 2) continue;
    ++score.seen_twice;
    const auto& first = of_object.front().frames;
    const auto& last = of_object.back().frames;
    const Eigen::Vector3d& centre_W = objects.at(object)->keys.front().centre_W;
    drifts.push_back((inFrameOf(frames[last[last.size() / 2]], centre_W) -
                      inFrameOf(frames[first[first.size() / 2]], centre_W))
                         .norm());
  }
  score.drift_m = quantile(std::move(drifts), 0.5);
  return score;
}

ReturnScore scoreReturn(const std::vector<MemoryFrame>& before, const std::vector<MemoryFrame>& now,
                        const MemoryOptions& options) {
  const auto known_ids = idsOf(before);
  const auto last_ids = lastIds(visitsOf(before, options));
  const auto owners = ownersOf(before);
  const std::size_t first = firstWith(known_ids, now);
  ReturnScore score;
  score.ids = known_ids.size();
  if (first < now.size()) {
    score.first = {toSeconds(now[first].time - now.front().time), now[first].way_m,
                   objectsIn(now, first + 1).size()};
  }
  std::map<std::uint64_t, Counts> ids;  // key: object; counts after the first known id
  for (std::size_t i = first; i < now.size(); ++i) {
    for (const auto& sighting : now[i].sightings) {
      auto& counts = ids[sighting.object];
      if (sighting.id) ++counts[*sighting.id];
    }
  }
  for (const std::uint64_t object : objectsIn(now, now.size())) {
    const auto last = last_ids.find(object);
    if (last == last_ids.end()) continue;
    ++score.known;
    if (!ids.contains(object)) continue;
    ++score.seen;
    const auto id = mostOften(ids.at(object));
    if (!id) continue;
    ++score.reported;
    const auto owner = owners.find(*id);
    score.kept += *id == last->second ? 1 : 0;
    score.wrong += owner != owners.end() && owner->second != object ? 1 : 0;
  }
  return score;
}

}  // namespace perdure::tools
