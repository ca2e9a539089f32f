// Judges the map and its graph from the latched topics of map_store.
#include <fmt/format.h>

#include "common/types/map_graph.h"
#include "tools/bus_tools/status/status.h"

namespace perdure::tools {
namespace {

std::string counted(std::uint32_t n, const char* one) {
  return fmt::format("{} {}{}", n, one, n == 1 ? "" : "s");
}

StatusNode judgeObjects(const MapHeader& header) {
  StatusNode node{"objects"};
  node.text = fmt::format("{} in {}", header.objects, counted(header.tiles, "tile"));
  node.data = {{"objects", header.objects}, {"tiles", header.tiles}, {"revision", header.revision}};
  return node;
}

std::string placeText(const MapFrame& frame) {
  if (!hasCovariance(frame)) return "how well the body's place is known cannot be told";
  if (frame.anchors <= 1) return "the map begins here";
  constexpr double kDegree = 180.0 / 3.14159265358979323846;
  const Eigen::Vector4d sigma = frame.covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
  return fmt::format("the body is known to {:.2f} m, {:.1f}° (σ)", sigma.head<2>().maxCoeff(),
                     kDegree * sigma[3]);
}

/// Judges the graph. A missing graph is no fault, because the graph can be disabled.
StatusNode judgeGraph(const std::optional<MapFrame>& frame) {
  StatusNode node{"graph"};
  if (!frame) {
    node.text = "none is told: graph.enabled of map_store is off, or no pose has come";
    return node;
  }
  node.text = fmt::format("{}, {}, {}; {}", counted(frame->anchors, "anchor"),
                          counted(frame->loops, "loop"), counted(frame->sessions, "session"),
                          placeText(*frame));
  node.data = {{"anchors", frame->anchors},
               {"loops", frame->loops},
               {"sessions", frame->sessions},
               {"revision", frame->revision}};
  if (hasCovariance(*frame)) {
    const Eigen::Vector4d sigma = frame->covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
    node.data["body_sigma"] = {sigma[0], sigma[1], sigma[2], sigma[3]};
  }
  return node;
}

}  // namespace

StatusNode judgeMap(const StatusSeen& seen) {
  StatusNode node{"map"};
  if (seen.map_header) node.add(judgeObjects(*seen.map_header));
  node.add(judgeGraph(seen.map_frame));
  return node;
}

}  // namespace perdure::tools
