// Graph of the map: queried from map_store and sent while there are viewers.

#include "services/gateway/node.h"

namespace perdure::gateway {

/// A new viewer receives the current graph.
void Node::lookAtGraph(bool looked_before) {
  if (wantsGraph() == looked_before) return;
  graph_pace_.begin();
  if (!wantsGraph()) graph_.reset();
}

/// Without viewers, no query is sent.
void Node::followGraph(std::int64_t now_ns) {
  if (!wantsGraph() || !graph_pace_.due(now_ns)) return;
  MapQuery query;
  query.kind = MapQueryKind::kGraph;
  query.low = map_.T_MW(world()) * pose().p;
  query.limit = kMostOfGraph;
  ask({0, kGraphOfTheMap, 0, {}}, query, now_ns);
}

void Node::onMapGraph(const MapReply& reply) {
  graph_ = reply;
  why_no_graph_ = reply.anchors.empty() ? "The map has no anchors yet." : "";
  sendWanted({kMapGraph, kMapGraphScene});
}

/// The known graph stays, because a recording has it without a map store.
void Node::onNoGraph(const std::string& why) {
  if (graph_ || why == why_no_graph_) return;
  why_no_graph_ = why;
  if (wants(kMapGraph)) sendGraph(kMapGraph);
}

void Node::sendGraph(std::uint32_t channel) {
  const MapReply here = graphOn(map_.mapOf(world()), graph_.value_or(MapReply()));
  if (channel == kMapGraphScene) return send(channel, mapGraphScene(here, time_));
  const bool elsewhere = here.anchors.empty() && graph_ && !graph_->anchors.empty();
  send(channel,
       mapGraphJson(here,
                    elsewhere ? "The graph is of a map on which this session is not found yet."
                              : why_no_graph_,
                    time_));
}

}  // namespace perdure::gateway
