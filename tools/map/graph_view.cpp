#include "tools/map/graph_view.h"

#include <fmt/format.h>

#include <cmath>
#include <map>
#include <numbers>
#include <set>

#include "common/types/map_graph.h"

namespace perdure::tools {
namespace {

using Json = nlohmann::ordered_json;
constexpr double kDegrees = 180.0 / std::numbers::pi;
constexpr std::size_t kMostNamed = 6;  // largest number of objects named for one loop

struct Figures {
  std::set<WorldId> sessions;
  double way_m = 0.0;
  std::size_t unknown = 0;            ///< anchors with unknown σ
  const MapAnchor* worst = nullptr;   ///< anchor with the largest σ in the plane
  std::map<MapLoopState, int> loops;  ///< numbers of loops by state
  int ties = 0;
};

double planeSigma(const MapAnchor& anchor) { return anchor.sigma.head<2>().maxCoeff(); }

Figures figuresOf(const MapReply& graph) {
  Figures figures;
  std::map<AnchorNumber, const MapAnchor*> by_id;
  for (const MapAnchor& anchor : graph.anchors) by_id[anchor.id] = &anchor;
  for (const MapAnchor& anchor : graph.anchors) {
    figures.sessions.insert(anchor.session);
    const auto before = by_id.find(anchor.previous);
    if (before != by_id.end()) figures.way_m += (anchor.p - before->second->p).norm();
    if (!hasSigma(anchor)) {
      ++figures.unknown;
    } else if (figures.worst == nullptr || planeSigma(anchor) > planeSigma(*figures.worst)) {
      figures.worst = &anchor;
    }
  }
  for (const MapLoop& loop : graph.loops) {
    if (loop.kind == MapLoopKind::kTie) {
      ++figures.ties;
    } else {
      ++figures.loops[loop.state];
    }
  }
  return figures;
}

std::string counted(std::size_t n, const char* what) {
  return fmt::format("{} {}{}", n, what, n == 1 ? "" : "s");
}

std::string witnessesOf(const MapLoop& loop) {
  std::string words;
  for (std::size_t k = 0; k < loop.pairs.size() && k < kMostNamed; ++k) {
    const MapLoopPair& pair = loop.pairs[k];
    words += fmt::format("{}{}", k == 0 ? "objects " : ", ", pair.known);
    if (pair.seen != pair.known) words += fmt::format(" (seen as {})", pair.seen);
  }
  if (loop.pairs.size() > kMostNamed) {
    words += fmt::format(" and {} more", loop.pairs.size() - kMostNamed);
  }
  if (!words.empty()) return words;
  if (loop.landmarks > 0) return fmt::format("{} landmarks that look alike", loop.landmarks);
  return "not known any more";
}

std::string worstLine(const Figures& figures) {
  std::string text = "how well     ";
  if (const MapAnchor* worst = figures.worst) {
    text +=
        fmt::format("worst at anchor {}: sigma {:.2f} {:.2f} {:.2f} m, {:.2f} deg", worst->id,
                    worst->sigma[0], worst->sigma[1], worst->sigma[2], worst->sigma[3] * kDegrees);
  } else {
    text += "not known";
  }
  if (figures.worst != nullptr && figures.unknown > 0) {
    text += fmt::format("; of {} not known", counted(figures.unknown, "anchor"));
  }
  return text + "\n";
}

std::string loopsLine(const Figures& figures) {
  const auto of = [&](MapLoopState state) {
    const auto at = figures.loops.find(state);
    return at == figures.loops.end() ? 0 : at->second;
  };
  return fmt::format("loops        {} confirmed, {} tentative, {} withdrawn; ties {}\n",
                     of(MapLoopState::kConfirmed), of(MapLoopState::kTentative),
                     of(MapLoopState::kWithdrawn), figures.ties);
}

std::string lineOf(const MapLoop& loop) {
  return fmt::format("{:>6}  {:<9} {:>6} {:>6}  {:>8.3f} {:>7.2f}  {:>7.2f} {:>6.3f}  {}\n",
                     loop.id, nameOf(loop.state), loop.a, loop.b, loop.residual.head<3>().norm(),
                     std::abs(loop.residual[3]) * kDegrees, loop.chi2, loop.weight,
                     witnessesOf(loop));
}

std::string tableOfLoops(const MapReply& graph) {
  std::string lines;
  for (const MapLoop& loop : graph.loops) {
    if (loop.kind == MapLoopKind::kLoop) lines += lineOf(loop);
  }
  if (lines.empty()) return lines;
  return fmt::format("\n{:>6}  {:<9} {:>6} {:>6}  {:>8} {:>7}  {:>7} {:>6}  {}\n", "loop", "state",
                     "a", "b", "off by m", "deg", "chi2(4)", "weight", "by") +
         lines;
}

/// Returns the standard deviations; null if they are unknown.
Json sigmaJson(const Eigen::Vector4d& sigma, bool known) {
  return known ? Json{sigma[0], sigma[1], sigma[2], sigma[3]} : Json();
}

Json worldJson(const WorldId& world) { return {{"world", world.world}, {"epoch", world.epoch}}; }

Json toJson(const MapAnchor& anchor) {
  return {{"id", anchor.id},
          {"previous", anchor.previous},
          {"session", worldJson(anchor.session)},
          {"position", {anchor.p.x(), anchor.p.y(), anchor.p.z()}},
          {"yaw", anchor.yaw},
          {"sigma", sigmaJson(anchor.sigma, hasSigma(anchor))},
          {"objects", anchor.objects}};
}

Json toJson(const MapLoop& loop) {
  Json pairs = Json::array();
  for (const MapLoopPair& pair : loop.pairs) pairs.push_back({pair.known, pair.seen});
  const Eigen::Vector4d& r = loop.residual;
  return {{"id", loop.id},
          {"kind", loop.kind == MapLoopKind::kTie ? "tie" : "loop"},
          {"state", nameOf(loop.state)},
          {"a", loop.a},
          {"b", loop.b},
          {"residual", {r[0], r[1], r[2], r[3]}},
          {"sigma", sigmaJson(loop.sigma, hasSigma(loop))},
          {"chi2", loop.chi2},
          {"weight", loop.weight},
          {"pairs", pairs},
          {"landmarks", loop.landmarks}};
}

}  // namespace

std::string toGraphText(const MapReply& graph) {
  if (graph.anchors.empty()) return "the map has no anchors yet\n";
  const Figures figures = figuresOf(graph);
  const WorldId& map = graph.anchors.front().map;
  std::string text = fmt::format(
      "map          world {}, epoch {}\nanchors      {} of {}, {:.0f} m travelled\n", map.world,
      map.epoch, graph.anchors.size(), counted(figures.sessions.size(), "session"), figures.way_m);
  if (graph.truncated) {
    text += fmt::format("told         the nearest of {} anchors and {} loops and ties\n",
                        graph.anchor_count, graph.loop_count);
  }
  return text + worstLine(figures) + loopsLine(figures) + tableOfLoops(graph);
}

Json toGraphJson(const MapReply& graph) {
  const Figures figures = figuresOf(graph);
  Json anchors = Json::array(), loops = Json::array();
  for (const MapAnchor& anchor : graph.anchors) anchors.push_back(toJson(anchor));
  for (const MapLoop& loop : graph.loops) loops.push_back(toJson(loop));
  return {{"map", graph.anchors.empty() ? Json() : worldJson(graph.anchors.front().map)},
          {"all_anchors", graph.anchor_count},
          {"all_loops", graph.loop_count},
          {"truncated", graph.truncated},
          {"sessions", figures.sessions.size()},
          {"way_m", figures.way_m},
          {"unknown_sigma", figures.unknown},
          {"anchors", anchors},
          {"loops", loops}};
}

}  // namespace perdure::tools
