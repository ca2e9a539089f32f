// Service calls of clients: the full state of one object, and queries of the map.
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "common/types/correction_json.h"
#include "services/gateway/node.h"

namespace perdure::gateway {
namespace {

using Json = nlohmann::json;
constexpr std::int64_t kPatience = 3'000'000'000;
constexpr std::size_t kMostPending = 64;

std::optional<double> numberOf(const Json& object, const char* name) {
  const auto found = object.find(name);
  if (found == object.end() || !found->is_number()) return std::nullopt;
  const double value = found->get<double>();
  return std::isfinite(value) ? std::optional(value) : std::nullopt;
}

std::optional<ObjectId> idOf(const Json& request, const char* name = "id") {
  const auto found = request.find(name);
  if (found == request.end() || !found->is_number_unsigned()) return std::nullopt;
  return found->get<ObjectId>();
}

std::optional<Eigen::Vector3d> placeOf(const Json& request, const char* name) {
  const auto found = request.find(name);
  if (found == request.end() || !found->is_array() || found->size() != 3) return std::nullopt;
  Eigen::Vector3d place;
  for (std::size_t i = 0; i < 3; ++i) {
    if (!(*found)[i].is_number()) return std::nullopt;
    place[static_cast<Eigen::Index>(i)] = (*found)[i].get<double>();
  }
  return place.allFinite() ? std::optional(place) : std::nullopt;
}

/// Returns the query of a request, or nothing if it has no valid one.
std::optional<MapQuery> queryOf(const Json& request) {
  MapQuery query;
  constexpr double kMost = 1000;
  query.limit =
      static_cast<std::uint32_t>(std::clamp(numberOf(request, "limit").value_or(200), 1.0, kMost));
  const auto near = placeOf(request, "near"), low = placeOf(request, "low"),
             high = placeOf(request, "high");
  const auto radius = numberOf(request, "radius");
  const auto name = request.find("class");
  if (const auto id = idOf(request)) {
    query.kind = MapQueryKind::kById;
    query.object_id = *id;
  } else if (name != request.end() && name->is_string()) {
    query.kind = MapQueryKind::kByClass;
    query.class_name = name->get<std::string>().substr(0, 64);
  } else if (near && radius && *radius > 0) {
    query.kind = MapQueryKind::kByRadius;
    query.low = *near;
    query.radius = *radius;
  } else if (low && high && (low->array() <= high->array()).all()) {
    query.kind = MapQueryKind::kByBox;
    query.low = *low;
    query.high = *high;
  } else if (request.empty() || (request.size() == 1 && request.contains("limit"))) {
    query.kind = MapQueryKind::kAll;
  } else {
    return std::nullopt;
  }
  return query;
}

}  // namespace

void Node::fail(const Call& call, const std::string& sentence) {
  if (call.service == kGraphOfTheMap) {
    graph_pace_.refused(ticked_ns_);
    return onNoGraph(sentence);
  }
  answer(call, sentence, false);
}

void Node::answer(const Call& call, std::string payload, bool ok) {
  outputs_.answer({call.client, call.service, call.call, ok, std::move(payload)});
}

void Node::onCall(const Call& call, std::int64_t now_ns) {
  if (call.service == kObjectService) {
    askForObject(call, now_ns);
  } else if (call.service == kCorrectService) {
    askForCorrection(call, now_ns);
  } else {
    askForMap(call, now_ns);
  }
}

void Node::askForObject(const Call& call, std::int64_t now_ns) {
  const Json request = Json::parse(call.payload, nullptr, false);
  const auto id = request.is_object() ? idOf(request) : std::nullopt;
  if (!id) return fail(call, "ask as {\"id\": 12}");
  if (objects_) {
    for (const ObjectBelief& object : objects_->objects) {
      if (object.id != *id) continue;
      const auto returns = returns_.find(*id);
      const auto found =
          returns == returns_.end() ? std::optional<Event>() : std::optional(returns->second);
      return answer(call, objectInFull(object, found, history_.of(*id)));
    }
  }
  MapQuery query;
  query.kind = MapQueryKind::kById;
  query.object_id = *id;
  ask(call, query, now_ns);
}

void Node::askForMap(const Call& call, std::int64_t now_ns) {
  const Json request = Json::parse(call.payload, nullptr, false);
  const auto query = request.is_object() ? queryOf(request) : std::nullopt;
  if (!query) {
    return fail(call,
                "ask as {\"id\": 12}, {\"class\": \"car\"}, {\"near\": [x, y, z], "
                "\"radius\": 20}, {\"low\": [x, y, z], \"high\": [x, y, z]}, or {}");
  }
  ask(call, *query, now_ns);
}

void Node::askForCorrection(const Call& call, std::int64_t now_ns) {
  if (config_.web.token.empty()) {
    reasons_.add("correction_without_token");
    return fail(call,
                "corrections need a token: set http.token of the gateway, and open its page with "
                "?token=…");
  }
  const Json request = Json::parse(call.payload, nullptr, false);
  const auto correction = correctionOf(request);
  if (!correction) return fail(call, std::string("correct as ") + kCorrectionForms);
  ask(call, MapCorrection{0, 0, *correction}, outputs_.correction, now_ns);
}

template <class Question>
void Node::ask(const Call& call, Question question, const Sink<Question>& to, std::int64_t now_ns) {
  if (pending_.size() >= kMostPending) {
    reasons_.add("too_many_questions");
    return fail(call, "too many questions wait for map_store");
  }
  question.client = instance_;
  question.request = next_request_++;
  pending_[question.request] = {call, [question, &to] { to(question); }, now_ns + kPatience,
                                now_ns};
  tick(now_ns);
}

void Node::onMapReply(const MapReply& reply) {
  const auto found = reply.client == instance_ ? pending_.find(reply.request) : pending_.end();
  if (found == pending_.end()) return;
  const Call call = found->second.call;
  pending_.erase(found);
  if (!reply.ok) return fail(call, reply.error);
  if (call.service == kGraphOfTheMap) {
    graph_pace_.answered(reply, ticked_ns_);
    return onMapGraph(reply);
  }
  if (call.service == kMapQueryService || call.service == kCorrectService) {
    answer(call, mapReplyJson(reply, map_.mapOf(world())));
  } else if (reply.beliefs.empty() || reply.beliefs.front().classes.empty()) {
    answer(call, R"({"found":false})");
  } else {
    const ObjectBelief& object = reply.beliefs.front();
    answer(call, objectInFull(object, std::nullopt, history_.of(object.id)));
  }
}

void Node::lookAtGraph(bool looked_before) {
  if (wantsGraph() == looked_before) return;
  graph_pace_.begin();
  if (!wantsGraph()) graph_.reset();
}

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
  if (wants(kMapSeen)) {
    const MapReply here = graphOn(map_.mapOf(world()), reply);
    seen_ground_.forgetAnchors();
    for (const auto& camera : cameras_) {
      if (camera) seen_ground_.addAnchors(*camera, here, map_.T_MW(world()), groundHeight());
    }
  }
  sendWanted({kMapGraph, kMapGraphScene, kMapSeen});
}

/// Takes a failure of the graph query. A graph that is already known stays, because a recording has
/// it without a map store.
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
