#include "services/gateway/core/map_graph.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <numbers>

#include "common/base/ids.h"
#include "common/types/map_graph.h"
#include "services/gateway/core/pieces.h"

namespace perdure::gateway {
namespace {

constexpr std::int64_t kGraphEach_ns = 3'000'000'000;
constexpr std::int64_t kRefused_ns = 5'000'000'000;

const char* wordOf(MapLoopKind kind) { return kind == MapLoopKind::kTie ? "tie" : "loop"; }

/// Returns the colour of a loop; words.js of the page has the same colours.
Colour colourOf(const MapLoop& loop) {
  if (loop.state == MapLoopState::kWithdrawn) return {1.0, 0.56, 0.53, 0.9};
  if (loop.state == MapLoopState::kTentative) return {0.96, 0.75, 0.25, 0.9};
  if (loop.kind == MapLoopKind::kTie) return {0.25, 0.75, 0.68, 0.7};
  return {0.77, 0.55, 1.0, 0.95};
}

std::string sessionOf(const MapAnchor& anchor) {
  return fmt::format("{}/{}", toHex(anchor.session.world), anchor.session.epoch);
}

/// Writes the standard deviations; an empty list if they are not known.
void putSigma(JsonWriter& json, const Eigen::Vector4d& sigma, bool known) {
  json.with("sigma", {sigma.data(), known ? 4U : 0U}, 4);
}

void putAnchor(JsonWriter& json, const MapAnchor& anchor) {
  json.begin('{').with("id", anchor.id).with("previous", anchor.previous);
  json.with("session", sessionOf(anchor)).with("at", {anchor.p.data(), 3}, 3);
  json.with("yaw", anchor.yaw, 4);
  putSigma(json, anchor.sigma, hasSigma(anchor));
  json.with("objects", anchor.objects).end('}');
}

void putLoop(JsonWriter& json, const MapLoop& loop) {
  json.begin('{').with("id", loop.id).with("a", loop.a).with("b", loop.b);
  json.with("kind", wordOf(loop.kind)).with("state", nameOf(loop.state));
  json.with("residual", {loop.residual.data(), 4}, 4);
  putSigma(json, loop.sigma, hasSigma(loop));
  json.with("chi2", loop.chi2, 3).with("weight", loop.weight, 3).key("pairs").begin('[');
  for (const MapLoopPair& pair : loop.pairs) {
    json.begin('[').integer(pair.known).integer(pair.seen).end(']');
  }
  json.end(']').with("landmarks", loop.landmarks).end('}');
}

std::string metresAndDegrees(const Eigen::Vector4d& v) {
  return fmt::format("{:.3f} {:.3f} {:.3f} m, {:.2f} deg", v[0], v[1], v[2],
                     v[3] * 180.0 / std::numbers::pi);
}

std::string sigmaInWords(const Eigen::Vector4d& sigma, bool known) {
  return known ? metresAndDegrees(sigma) : "not known";
}

std::string witnessesOf(const MapLoop& loop) {
  std::string words;
  for (const MapLoopPair& pair : loop.pairs) {
    words += fmt::format("{}{}", words.empty() ? "" : ", ", pair.known);
    if (pair.seen != pair.known) words += fmt::format(" (seen as {})", pair.seen);
  }
  if (!words.empty()) return words;
  if (loop.landmarks > 0) return fmt::format("{} landmarks that look alike", loop.landmarks);
  return loop.kind == MapLoopKind::kTie ? "objects that still had their ids" : "not known any more";
}

void putSphere(JsonWriter& json, TimePoint time, const MapAnchor& anchor) {
  constexpr double kSize_m = 0.6;
  beginEntity(json, time, kMapFrame, fmt::format("anchor {}", anchor.id));
  json.key("metadata").begin('[');
  putPair(json, "anchor", std::to_string(anchor.id));
  putPair(json, "session", sessionOf(anchor));
  putPair(json, "sigma x y z, yaw", sigmaInWords(anchor.sigma, hasSigma(anchor)));
  putPair(json, "objects", std::to_string(anchor.objects));
  json.end(']');
  putSolid(json, "spheres", {rotationOfYaw(anchor.yaw), anchor.p},
           Eigen::Vector3d::Constant(kSize_m),
           hasSigma(anchor) ? Colour{0.56, 0.72, 0.87, 0.9} : Colour{0.55, 0.55, 0.55, 0.9});
  endEntity(json, {"arrows", "cubes", "cylinders", "lines", "triangles", "texts", "models"});
}

constexpr std::initializer_list<const char*> kNoneButLines = {
    "arrows", "cubes", "spheres", "cylinders", "triangles", "texts", "models"};

using AnchorsById = std::map<AnchorNumber, const MapAnchor*>;

void putWay(JsonWriter& json, TimePoint time, const MapReply& graph, const AnchorsById& by_id) {
  std::vector<Eigen::Vector3d> ends;
  for (const MapAnchor& anchor : graph.anchors) {
    const auto before = by_id.find(anchor.previous);
    if (before == by_id.end()) continue;
    ends.push_back(before->second->p);
    ends.push_back(anchor.p);
  }
  beginEntity(json, time, kMapFrame, "graph way");
  json.key("metadata").begin('[');
  putPair(json, "anchors", std::to_string(graph.anchor_count));
  putPair(json, "loops", std::to_string(graph.loop_count));
  if (graph.truncated) putPair(json, "shown", "those nearest to the vehicle");
  json.end(']');
  putLine(json, LineType::kSegments, 1.5, ends, {0.44, 0.58, 0.72, 0.6});
  endEntity(json, kNoneButLines);
}

/// Draws a raised arch between the ends of the loop, because both may lie on the trajectory.
void putArch(JsonWriter& json, TimePoint time, const MapLoop& loop, const Eigen::Vector3d& a,
             const Eigen::Vector3d& b) {
  const Eigen::Vector3d top =
      (a + b) / 2 + (1.0 + 0.15 * (b - a).norm()) * Eigen::Vector3d::UnitZ();
  beginEntity(json, time, kMapFrame, fmt::format("loop {}", loop.id));
  json.key("metadata").begin('[');
  putPair(json, wordOf(loop.kind), std::to_string(loop.id));
  putPair(json, "state", nameOf(loop.state));
  putPair(json, "anchors", fmt::format("{} and {}", loop.a, loop.b));
  putPair(json, "residual x y z, yaw", metresAndDegrees(loop.residual));
  putPair(json, "sigma x y z, yaw", sigmaInWords(loop.sigma, hasSigma(loop)));
  putPair(json, "chi2 of 4", fmt::format("{:.2f}", loop.chi2));
  putPair(json, "weight", fmt::format("{:.3f}", loop.weight));
  putPair(json, "by objects", witnessesOf(loop));
  json.end(']');
  putLine(json, LineType::kStrip, 3.0, {a, top, b}, colourOf(loop));
  endEntity(json, kNoneButLines);
}

}  // namespace

bool GraphPace::due(std::int64_t now_ns) {
  if (!stale_ || waits_ || now_ns < next_ns_) return false;
  stale_ = false;
  waits_ = true;
  return true;
}

void GraphPace::answered(const MapReply& reply, std::int64_t now_ns) {
  constexpr std::size_t kASecond = 200;
  const auto size =
      static_cast<std::int64_t>((reply.anchors.size() + reply.loops.size()) / kASecond);
  waits_ = false;
  next_ns_ = now_ns + std::max(kGraphEach_ns, 1'000'000'000 * size);
}

void GraphPace::refused(std::int64_t now_ns) {
  waits_ = false;
  stale_ = true;
  next_ns_ = now_ns + kRefused_ns;
}

MapReply graphOn(const WorldId& map, MapReply reply) {
  std::erase_if(reply.anchors, [&](const MapAnchor& anchor) { return anchor.map != map; });
  if (reply.anchors.empty()) {
    reply.loops.clear();
    reply.anchor_count = reply.loop_count = 0;
  }
  return reply;
}

std::string mapGraphJson(const MapReply& graph, const std::string& why_none, TimePoint time) {
  JsonWriter json(512 + 160 * graph.anchors.size() + 256 * graph.loops.size());
  json.begin('{').with("timestamp", time).with("frame_id", kMapFrame).with("why_none", why_none);
  json.with("all_anchors", graph.anchor_count).with("all_loops", graph.loop_count);
  json.with("truncated", graph.truncated).key("anchors").begin('[');
  for (const MapAnchor& anchor : graph.anchors) putAnchor(json, anchor);
  json.end(']').key("loops").begin('[');
  for (const MapLoop& loop : graph.loops) putLoop(json, loop);
  return json.end(']').end('}').take();
}

std::string mapGraphScene(const MapReply& graph, TimePoint time) {
  AnchorsById by_id;
  for (const MapAnchor& anchor : graph.anchors) by_id[anchor.id] = &anchor;
  JsonWriter json(1024 + 768 * graph.anchors.size() + 1024 * graph.loops.size());
  json.begin('{').key("deletions").begin('[');
  putDeletion(json, time, DeletionType::kAll, "");
  json.end(']').key("entities").begin('[');
  if (!graph.anchors.empty()) putWay(json, time, graph, by_id);
  for (const MapAnchor& anchor : graph.anchors) putSphere(json, time, anchor);
  for (const MapLoop& loop : graph.loops) {
    const auto a = by_id.find(loop.a), b = by_id.find(loop.b);
    if (a == by_id.end() || b == by_id.end()) continue;
    putArch(json, time, loop, a->second->p, b->second->p);
  }
  return json.end(']').end('}').take();
}

}  // namespace perdure::gateway
