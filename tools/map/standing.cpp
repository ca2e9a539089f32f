#include "tools/map/standing.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/mapping/parameters.h"

namespace perdure::tools {
namespace {

using mapping::AnchorId;
using mapping::SavedMap;

constexpr std::size_t kMostTold = 8;  // largest numbers of listed loops and of listed ids

std::optional<Station> stationOf(AnchorId id, const SavedMap& map) {
  const auto at = map.anchors.find(id);
  if (at == map.anchors.end()) return std::nullopt;
  const mapping::Anchor& anchor = at->second.anchor;
  return Station{id, anchor.session, anchor.stamp.time, anchor.way_m};
}

std::uint32_t countOf(const Ledger& ledger, ExistenceEvidence kind) {
  const auto index = static_cast<std::size_t>(kind);
  return index < ledger.existence.size() ? ledger.existence[index].count : 0;
}

bool isNear(AnchorId id, const std::optional<Station>& station, const SavedMap& map) {
  if (!station) return false;
  const auto at = map.anchors.find(id);
  const Eigen::Vector3d& from = map.anchors.at(station->anchor).T_MA.p;
  return at != map.anchors.end() &&
         (at->second.T_MA.p - from).norm() <= mapping::LoopParameters().view_m;
}

std::string wordsOf(const WorldId& world) {
  return fmt::format("world {}, epoch {}", world.world, world.epoch);
}

std::string oftenOf(std::uint32_t n) { return n == 1 ? "once" : fmt::format("{} times", n); }

std::string line(const Station& station, const char* what) {
  return fmt::format(
      "  {} from anchor {}, where the body was at {:.3f} s after {:.0f} m travelled ({})\n", what,
      station.anchor, toSeconds(station.time), station.way_m, wordsOf(station.session));
}

std::string line(const Standing::Loop& loop) {
  return fmt::format(
      "    loop {} of anchors {} and {}, by {}: {} (weight {:.2f})\n", loop.id, loop.a, loop.b,
      loop.by_tracking ? "objects seen again under their ids" : "positions of objects or landmarks",
      loop.weight >= mapping::kBelieved ? "believed" : "not believed", loop.weight);
}

std::string loopLines(const Standing& standing) {
  if (standing.loops.empty()) return "  no loop ends where it was seen from\n";
  std::string text = fmt::format("  loops that end near there: {}{}\n", standing.loops.size(),
                                 standing.loops.size() > kMostTold ? "; the newest:" : "");
  for (std::size_t k = 0; k < std::min(kMostTold, standing.loops.size()); ++k) {
    text += line(standing.loops[k]);
  }
  return text;
}

std::string absorbedLine(const std::vector<ObjectId>& absorbed) {
  std::string ids;
  for (std::size_t k = 0; k < std::min(kMostTold, absorbed.size()); ++k) {
    ids += fmt::format("{}{}", k == 0 ? "" : ", ", absorbed[k]);
  }
  return fmt::format(
      "  merged into it: {}{}\n", ids,
      absorbed.size() > kMostTold ? fmt::format(" and {} more", absorbed.size() - kMostTold) : "");
}

nlohmann::ordered_json toJson(const Station& station) {
  return {{"anchor", station.anchor},
          {"world", station.session.world},
          {"epoch", station.session.epoch},
          {"time_ns", toNanoseconds(station.time)},
          {"way_m", station.way_m}};
}

}  // namespace

Standing standingOf(const ObjectBelief& belief, const WorldId& world, const SavedMap& map,
                    std::vector<ObjectId> absorbed) {
  const mapping::MapState state({}, map);
  const mapping::MapFrames frames(state);
  const auto record = map.records.find(belief.id);
  const mapping::ObjectRecord* known = record == map.records.end() ? nullptr : &record->second;
  const AnchorId anchor = frames.anchorOf(known, world, belief.last_seen);
  const Eigen::Vector3d p_W = belief.best().mean.head<3>();
  Standing standing;
  standing.frame = frames.at(anchor, world);
  standing.moved_m = (standing.frame.T_MW * p_W - p_W).norm();
  standing.newest = stationOf(anchor, map);
  if (known != nullptr && known->earlier) {
    standing.earlier = stationOf(known->earlier->anchor, map);
  }
  standing.recalls = countOf(belief.why, ExistenceEvidence::kRecall);
  standing.restarts = countOf(belief.why, ExistenceEvidence::kRestore);
  standing.absorbed = std::move(absorbed);
  for (auto at = map.edges.rbegin(); at != map.edges.rend(); ++at) {
    const auto& [edge, weight] = at->second;
    if (edge.kind == mapping::EdgeKind::kOdometry) continue;
    const bool ends_there =
        isNear(edge.a, standing.newest, map) || isNear(edge.b, standing.newest, map) ||
        isNear(edge.a, standing.earlier, map) || isNear(edge.b, standing.earlier, map);
    if (!ends_there) continue;
    standing.loops.push_back(
        {at->first, edge.a, edge.b, edge.kind == mapping::EdgeKind::kTracking, weight});
  }
  return standing;
}

std::string toText(const Standing& s) {
  std::string text = fmt::format(
      "On the map:\n  in M of {}{}\n", wordsOf(s.frame.map),
      s.frame.provisional ? "; provisional: its session is not found on the map of before" : "");
  if (!s.newest) return text + "  it belongs to no anchor: it is where it was stored\n";
  text += line(*s.newest, "seen last");
  if (s.earlier) text += line(*s.earlier, "on the visit before");
  text += fmt::format("  the graph has moved it by {:.2f} m from where it was stored\n", s.moved_m);
  if (s.recalls > 0) text += "  recalled from the map " + oftenOf(s.recalls) + "\n";
  if (s.restarts > 0) text += "  restored after a restart " + oftenOf(s.restarts) + "\n";
  if (!s.absorbed.empty()) text += absorbedLine(s.absorbed);
  return text + loopLines(s);
}

nlohmann::ordered_json toJson(const Standing& s) {
  auto loops = nlohmann::ordered_json::array();
  for (const Standing::Loop& loop : s.loops) {
    loops.push_back({{"loop", loop.id},
                     {"anchors", {loop.a, loop.b}},
                     {"by", loop.by_tracking ? "tracking" : "constellation"},
                     {"weight", loop.weight},
                     {"believed", loop.weight >= mapping::kBelieved}});
  }
  nlohmann::ordered_json json = {{"world", s.frame.map.world},
                                 {"epoch", s.frame.map.epoch},
                                 {"provisional", s.frame.provisional},
                                 {"moved_m", s.moved_m},
                                 {"recalls", s.recalls},
                                 {"restarts", s.restarts},
                                 {"merged", s.absorbed},
                                 {"loops", loops}};
  if (s.newest) json["seen_from"] = toJson(*s.newest);
  if (s.earlier) json["visit_before"] = toJson(*s.earlier);
  return json;
}

}  // namespace perdure::tools
