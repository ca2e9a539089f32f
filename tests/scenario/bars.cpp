#include "tests/scenario/bars.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <set>
#include <stdexcept>

namespace perdure::test {
namespace {

/// Counts the frames with a hit of an object in which its existence nevertheless decreased by more
/// than the effect of time (a share of dt / survival), and the largest decrease.
struct Falls {
  double count = 0.0, most = 0.0;
};

Falls fallsOnHits(const Outcome& run) {
  constexpr double kTime = 1e-3;
  Falls falls;
  std::map<ObjectId, const Glance*> before;
  for (const JournalFrame& f : run.journal.frames) {
    for (const Glance& g : f.objects) {
      const auto last = before.find(g.id);
      if (last != before.end() && g.confirmed && g.hits > last->second->hits) {
        const double fall = last->second->existence - g.existence;
        falls.count += fall > kTime ? 1.0 : 0.0;
        falls.most = std::max(falls.most, fall);
      }
      before[g.id] = &g;
    }
  }
  return falls;
}

/// Counts of merges, judged by the beliefs published just before them.
struct Merges {
  double count = 0.0, again = 0.0, younger = 0.0, lost_hits = 0.0, lost_existence = 0.0;
};

Merges mergesOf(const Outcome& run) {
  Merges merges;
  std::set<std::uint64_t> absorbed;
  std::map<std::uint64_t, std::uint64_t> claimed_at;  // first frame of each id
  for (const JournalFrame& f : run.journal.frames) {
    for (const Glance& g : f.objects) {
      if (g.confirmed) claimed_at.try_emplace(g.id, f.frame);
    }
  }
  const auto wasClaimed = [&](std::uint64_t id, std::uint64_t until) {
    const auto it = claimed_at.find(id);
    return it != claimed_at.end() && it->second <= until;
  };
  for (const auto& event : run.events) {
    if (event["event"] != "merged") continue;
    merges.count += 1.0;
    const std::uint64_t kept = event["object_id"], other = event["other_id"], at = event["frame"];
    if (!absorbed.insert(other).second) merges.again += 1.0;
    const JournalFrame *after = run.journal.at(at), *before = at > 0 ? run.journal.at(at - 1) : 0;
    const Glance* now = after ? after->find(kept) : nullptr;
    const Glance* a = before ? before->find(kept) : nullptr;
    const Glance* b = before ? before->find(other) : nullptr;
    if (!now || !a || !b) continue;
    // A confirmed object keeps its id, even if an unconfirmed one is older.
    const bool kept_was = wasClaimed(kept, before->frame);
    const bool other_was = wasClaimed(other, before->frame);
    if (kept_was == other_was && b->first_seen < a->first_seen) merges.younger += 1.0;
    if (now->hits < a->hits + b->hits) merges.lost_hits += 1.0;
    // A miss in the same frame may reduce the existence a little.
    if (now->existence < std::max(a->existence, b->existence) - 0.05) merges.lost_existence += 1.0;
  }
  return merges;
}

using BarsOf = std::function<Bars(const Outcome&)>;

const std::vector<std::pair<std::string, BarsOf>>& table() {
  static const std::vector<std::pair<std::string, BarsOf>> all{
      {"still", stillBars},
      {"occlusion", [](const Outcome& r) { return occlusionBars(r) + commonBars(r); }},
      {"vanish", [](const Outcome& r) { return vanishBars(r) + commonBars(r); }},
      {"room", [](const Outcome& r) { return roomBars(r) + commonBars(r); }},
      {"row", [](const Outcome& r) { return rowBars(r) + commonBars(r); }},
      {"roll", [](const Outcome& r) { return rollBars(r) + commonBars(r); }},
      {"traffic", [](const Outcome& r) { return trafficBars(r) + commonBars(r); }},
      {"street", [](const Outcome& r) { return streetBars(r) + commonBars(r); }}};
  return all;
}

}  // namespace

double number(std::size_t count) { return static_cast<double>(count); }

std::uint64_t frameAt(const Outcome& run, TimePoint time) {
  const auto& frames = run.truth.frames;
  const auto next = std::lower_bound(frames.begin(), frames.end(), time);
  if (next == frames.end()) return frames.size() - 1;
  return static_cast<std::uint64_t>(next - frames.begin());
}

std::uint64_t mostClaimed(const std::vector<tools::EstimateRow>& rows, const Eigen::Vector3d& place,
                          double within, const std::string& class_name, std::uint64_t from,
                          std::uint64_t until) {
  std::map<std::uint64_t, int> claims;
  for (const auto& row : rows) {
    const bool asked = class_name.empty() || row.class_name == class_name;
    const bool near = (row.centre_W - place).norm() < within;
    if (asked && near && row.frame >= from && row.frame < until) ++claims[row.id];
  }
  std::uint64_t best = 0;
  for (const auto& [id, count] : claims) best = best == 0 || count > claims[best] ? id : best;
  return best;
}

Bars commonBars(const Outcome& run) {
  const tools::Cell& cell = run.final.cells[1][2];
  return {onAverage(atLeast(0.80, "recall under 1 m", cell.recall())),
          onAverage(atLeast(0.80, "precision under 1 m", cell.precision())),
          onAverage(atMost(1.05, "objects for each one found", run.final.idsPerFound()))};
}

Bars everywhereBars(const Outcome& run) {
  const Falls falls = fallsOnHits(run);
  const Merges merges = mergesOf(run);
  return {atMost(0, "observations that showed a reported object and lowered its existence",
                 falls.count),
          atMost(0, "objects that were merged twice", merges.again),
          atMost(0, "merges that kept the younger id", merges.younger),
          atMost(0, "merges that lost hits", merges.lost_hits),
          atMost(0, "merges that lost existence", merges.lost_existence)};
}

const std::vector<std::string>& scenesWithBars() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> all{"toy"};
    for (const auto& [name, bars] : table()) all.push_back(name);
    return all;
  }();
  return names;
}

std::vector<Bars> barsOf(const std::string& scene, const std::vector<std::uint64_t>& seeds,
                         const Setting& setting) {
  std::vector<Bars> result;
  for (const std::uint64_t seed : seeds) {
    Setting one = setting;
    one.scene = scene;
    one.seed = seed;
    const Outcome run = runScene(one);
    if (scene == "toy") {
      result.push_back(toyBars(run, runScene(withoutSizePrior(one))) + everywhereBars(run));
      continue;
    }
    const auto found = std::find_if(table().begin(), table().end(),
                                    [&](const auto& entry) { return entry.first == scene; });
    if (found == table().end()) throw std::invalid_argument("no bars for the scene " + scene);
    result.push_back(found->second(run) + everywhereBars(run));
  }
  return result;
}

}  // namespace perdure::test
