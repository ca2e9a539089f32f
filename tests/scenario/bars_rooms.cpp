// Bars of occlusion, vanish and room: hidden objects stay, removed objects are deleted.
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "tests/scenario/bars.h"

namespace perdure::test {
namespace {

/// Returns the chair behind the monitor.
sim::TruthObject hiddenChair(const Outcome& run) {
  for (const auto& chair : run.standing("chair")) {
    const Eigen::Vector3d& p = chair.keys[0].centre_W;
    if (std::abs(p.y()) < 0.2 && std::abs(p.x() - 1.0) < 0.2) return chair;
  }
  throw std::runtime_error("the scene has no chair behind the monitor");
}

/// Counts the `occluded` events of an object: all, and those whose occluder has the right class.
struct Named {
  double all = 0.0, right = 0.0;
};

Named blockersNamed(const Outcome& run, std::uint64_t id, const std::string& class_name) {
  Named named;
  for (const auto& event : run.events) {
    if (event["event"] != "occluded" || event["object_id"] != id) continue;
    named.all += 1.0;
    const JournalFrame* f = run.journal.at(event["frame"]);
    const Glance* by = f ? f->find(event.value("other_id", std::uint64_t{0})) : nullptr;
    named.right += by != nullptr && by->className() == class_name ? 1.0 : 0.0;
  }
  return named;
}

struct Hidden {
  double frames = 0.0, changes = 0.0;
};

Hidden whileHidden(const Outcome& run, std::uint64_t id) {
  Hidden hidden;
  std::uint64_t bits = 0;
  for (const auto& [frame, glance] : run.journal.of(id)) {
    if (glance->visibility == Visibility::kOccluded) {
      hidden.frames += 1.0;
      hidden.changes += bits != 0 && glance->bits != bits ? 1.0 : 0.0;
    }
    bits = glance->bits;
  }
  return hidden;
}

/// Returns the mean time between frames.
double frameSeconds(const Outcome& run) {
  const auto& frames = run.journal.frames;
  return toSeconds(frames.back().time - frames.front().time) /
         static_cast<double>(std::max<std::size_t>(frames.size() - 1, 1));
}

struct Returns {
  double foreseen = 0.0, inside = 0.0;
  double last_error = 0.0;  ///< frames, largest error of the last predictions before the returns
};

/// Compares the predicted returns of an object with the times at which it was seen again.
Returns returnsOf(const Outcome& run, std::uint64_t id) {
  struct Said {
    double at_s, expected, earliest, latest;
  };
  Returns result;
  std::vector<Said> said;
  for (const auto& event : run.events) {
    if (event["object_id"] != id) continue;
    const double now = 1e-9 * static_cast<double>(event["timestamp_ns"].get<std::int64_t>());
    if (event["event"] == "predicted_return") {
      said.push_back({now, now + event["returns_in_s"].get<double>(),
                      now + event["interval_s"][0].get<double>(),
                      now + event["interval_s"][1].get<double>()});
    }
    if (event["event"] != "reappeared") continue;
    for (const Said& s : said) {
      result.foreseen += 1.0;
      result.inside += s.earliest <= now && now <= s.latest ? 1.0 : 0.0;
    }
    if (!said.empty()) {
      constexpr double kRounding = 1e-6;  // rounding of the seconds since the clock's start, in
                                          // frames
      const double error = std::abs(said.back().expected - now) / frameSeconds(run) - kRounding;
      result.last_error = std::max(result.last_error, error);
    }
    said.clear();
  }
  return result;
}

struct Fading {
  double falls_hidden = 0.0;               ///< frames in which existence decreased while the object
                                           ///< was hidden
  double to_missing = 1e3, to_gone = 1e3;  ///< frames with the object in view until the event
  double said_hidden = 0.0;                ///< events in frames in which the object was not in view
};

Fading fadingOf(const Outcome& run, std::uint64_t id, TimePoint since) {
  Fading fading;
  double in_sight = 0.0, before = 0.0;
  std::map<std::uint64_t, double> seen_until;  // by frame
  std::map<std::uint64_t, bool> seen_at;
  for (const JournalFrame& f : run.journal.frames) {
    const Glance* g = f.find(id);
    if (g != nullptr) {
      if (!g->in_sight && g->existence < before) fading.falls_hidden += 1.0;
      before = g->existence;
    }
    // An object is not published in the frame of its deletion. That frame counts as in view,
    // because only a visible miss deletes an object.
    const bool looked_for = g == nullptr || g->in_sight;
    if (f.time >= since && looked_for) in_sight += 1.0;
    seen_until[f.frame] = in_sight;
    seen_at[f.frame] = looked_for;
  }
  for (const auto& event : run.events) {
    const bool missing = event["event"] == "missing", gone = event["event"] == "gone";
    if (event["object_id"] != id || (!missing && !gone)) continue;
    (missing ? fading.to_missing : fading.to_gone) = seen_until[event["frame"]];
    fading.said_hidden += seen_at[event["frame"]] ? 0.0 : 1.0;
  }
  return fading;
}

}  // namespace

Bars occlusionBars(const Outcome& run) {
  const Eigen::Vector3d place = hiddenChair(run).keys[0].centre_W;
  const auto ids = Outcome::idsNear(run.inst_rows, place, 0.4, "chair");
  const std::uint64_t id = mostClaimed(run.inst_rows, place, 0.4, "chair");
  const Hidden hidden = whileHidden(run, id);
  const Named named = blockersNamed(run, id, "monitor");
  const Returns returns = returnsOf(run, id);
  return {atMost(1, "ids of the hidden chair", number(ids.size())),
          atLeast(1, "chairs at its place at the end", number(run.countNear(place, 0.4, "chair"))),
          atMost(0, "times that it was given up", number(run.countEvents("gone", ids))),
          atLeast(60, "frames in which it was hidden", hidden.frames),
          atMost(0, "of them those that changed a bit of existence, PMF, mean, covariance",
                 hidden.changes),
          atLeast(2, "`occluded` events of it that name the monitor", named.right),
          atMost(0, "that name another object", named.all - named.right),
          atLeast(4, "predictions of its return", returns.foreseen),
          atMost(1, "frames by which the last one before a return is wrong", returns.last_error),
          atLeast(0.9, "share of the predictions whose interval holds the return",
                  returns.inside / std::max(returns.foreseen, 1.0))};
}

Bars vanishBars(const Outcome& run) {
  const TimePoint start = run.truth.frames.front(), end = run.truth.frames.back();
  const sim::TruthObject *taken = nullptr, *moved = nullptr;
  for (const auto& object : run.truth.truth.objects) {
    if (object.presentAt(start) && !object.presentAt(end)) taken = &object;
    if (object.keys.size() > 1) moved = &object;
  }
  if (taken == nullptr || moved == nullptr) throw std::runtime_error("nothing vanishes");
  const Eigen::Vector3d from = moved->keys[0].centre_W, to = moved->at(end).centre_W;
  const Eigen::Vector3d empty = taken->keys[0].centre_W;
  const std::uint64_t until = frameAt(run, taken->present_until);
  const auto gone = mostClaimed(run.inst_rows, empty, 0.5, "chair", 0, until);
  const auto old = mostClaimed(run.inst_rows, from, 0.5, "chair", 0, until);
  const Fading fading = fadingOf(run, gone, taken->present_until);
  double same = 0.0, second = 0.0;
  for (const auto& chair : run.believed("chair")) {
    if ((chair.centre - to).norm() > 0.5) continue;
    (chair.id == old ? same : second) += 1.0;
  }
  return {atMost(0, "frames in which its existence fell while it was hidden", fading.falls_hidden),
          atMost(10, "visible frames until the one that was taken is `missing`", fading.to_missing),
          atMost(30, "visible frames until it is `gone`", fading.to_gone),
          atMost(0, "times that this was said while it was hidden", fading.said_hidden),
          atMost(0, "chairs on the map where it was", number(run.countNear(empty, 0.5, "chair"))),
          atLeast(1, "`moved` events of the one that was moved",
                  number(run.countEvents("moved", {old}))),
          atLeast(1, "it is on the map where it stands now, with its id", same),
          atMost(0, "second objects there", second),
          atMost(0, "chairs on the map where it stood before",
                 number(run.countNear(from, 0.5, "chair")))};
}

Bars roomBars(const Outcome& run) {
  double pairs = 0.0, two = 0.0;
  const auto claimed = [&](const sim::TruthObject& o) {
    return mostClaimed(run.inst_rows, o.keys[0].centre_W, 0.5, o.class_name);
  };
  for (const auto& table : run.standing("dining table")) {
    for (const auto& chair : run.standing("chair")) {
      const Eigen::Vector3d apart = table.keys[0].centre_W - chair.keys[0].centre_W;
      if (apart.head<2>().norm() > 1.0 || claimed(table) == 0 || claimed(chair) == 0) continue;
      pairs += 1.0;
      const bool both = run.countNear(table.keys[0].centre_W, 0.5, "dining table") > 0 &&
                        run.countNear(chair.keys[0].centre_W, 0.5, "chair") > 0;
      two += both ? 1.0 : 0.0;
    }
  }
  return {
      atLeast(1, "chairs within a metre of a table's middle, both once reported", pairs),
      atLeast(1.0, "share of them that are two objects at the end", two / std::max(pairs, 1.0))};
}

}  // namespace perdure::test
