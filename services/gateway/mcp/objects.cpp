#include "services/gateway/mcp/objects.h"

#include <algorithm>
#include <cmath>

#include "common/types/ledger_json.h"

namespace perdure::gateway::mcp {
namespace {

Json listOf(const Eigen::Vector3d& v) {
  return Json::array({rounded(v.x()), rounded(v.y()), rounded(v.z())});
}

/// The time of the last observation that changed the existence.
TimePoint lastEvidence(const ObjectBelief& object) {
  TimePoint last = object.last_seen;
  for (const auto kind :
       {ExistenceEvidence::kHit, ExistenceEvidence::kRepeated, ExistenceEvidence::kMiss}) {
    const auto k = static_cast<std::size_t>(kind);
    if (k >= object.why.existence.size() || object.why.existence[k].count == 0) continue;
    last = std::max(last, object.why.existence[k].last);
  }
  return last;
}

void putExistence(const ObjectBelief& object, Json& json) {
  constexpr double kTolerance = 1e-9;
  const double sum = object.why.logOdds();
  const bool explained =
      !object.why.empty() && std::abs(1.0 / (1.0 + std::exp(-sum)) - object.existence) < kTolerance;
  const double log_odds = explained ? sum : logOdds(object.existence);
  json["probability"] = rounded(object.existence);
  json["log_odds"] = rounded(log_odds);
  json["evidence"] = object.why.empty() ? Json::object() : toJson(object.why)["existence"];
  if (!explained) json["evidence"]["unexplained"] = {{"log_odds", rounded(log_odds - sum)}};
}

/// Lists the objects that may meet the conditions.
MapReply candidates(Map& map, const Conditions& conditions) {
  if (conditions.near) return objectsIn(map, *conditions.near, conditions.radius_m);
  MapQuery query;
  query.limit = kMostListed;
  query.class_name = conditions.class_name;
  query.kind = query.class_name.empty() ? MapQueryKind::kAll : MapQueryKind::kByClass;
  return map.ask(query);
}

const Ended* endOf(const State& state, ObjectId id) {
  const auto at =
      std::ranges::find(state.ended, id, [](const Ended& each) { return each.last.id; });
  return at == state.ended.end() ? nullptr : &*at;
}

}  // namespace

Json toJson(const ObjectBelief& object, const State& state) {
  Json json{{"id", object.id}};
  putExistence(object, json);
  if (object.classes.empty()) return json;
  const ClassBelief& best = object.best();
  json["age_s"] = rounded(toSeconds(state.now - lastEvidence(object)));
  json["class"] = best.name;
  json["class_probability"] = rounded(best.probability);
  json["position_m"] = listOf(best.mean.head<3>());
  json["sigma_m"] = listOf(best.covariance.diagonal().head<3>().cwiseMax(0.0).cwiseSqrt());
  json["yaw_rad"] = rounded(best.mean[3]);
  json["size_m"] = listOf(best.mean.tail<3>().array().exp());
  json["first_seen_s"] = rounded(toSeconds(object.first_seen));
  json["last_seen_s"] = rounded(toSeconds(object.last_seen));
  json["hits"] = object.hits;
  return json;
}

Json toJson(const Ended& ended, const State& state) {
  Json json = toJson(ended.last, state);
  json["status"] = perdure::nameOf(ended.kind);
  json["age_s"] = rounded(toSeconds(state.now - ended.time));
  json["ended_s"] = rounded(toSeconds(ended.time));
  return json;
}

std::optional<ObjectBelief> beliefOf(Map& map, ObjectId id) {
  MapQuery query;
  query.kind = MapQueryKind::kById;
  query.object_id = id;
  MapReply reply = map.ask(query);
  if (reply.beliefs.empty() || reply.beliefs.front().classes.empty()) return std::nullopt;
  return std::move(reply.beliefs.front());
}

MapReply objectsIn(Map& map, const Eigen::Vector2d& centre, double half_side) {
  constexpr double kAnyHeight = 1e6;
  MapQuery query;
  query.kind = MapQueryKind::kByBox;
  query.low << centre.array() - half_side, -kAnyHeight;
  query.high << centre.array() + half_side, kAnyHeight;
  query.limit = kMostListed;
  return map.ask(query);
}

Matches matchesOf(Map& map, const Conditions& conditions, const Before& before,
                  TimePoint first_seen) {
  MapReply listed = candidates(map, conditions);
  std::erase_if(listed.objects, [&](const MapObject& object) {
    return !conditions.includes(object.mean.head<2>()) || object.last_seen < conditions.since ||
           object.first_seen > conditions.until || object.first_seen < first_seen ||
           (!conditions.near && !conditions.matchesClass(object.class_name));
  });
  std::ranges::sort(listed.objects, before);
  Matches matches{{}, listed.truncated || listed.objects.size() > kMostInFull};
  listed.objects.resize(std::min(listed.objects.size(), kMostInFull));
  for (const MapObject& object : listed.objects) {
    auto belief = beliefOf(map, object.id);
    if (!belief) continue;
    const double probability = conditions.probabilityOf(*belief);
    if (probability <= 0.0 || probability < conditions.least_probability) continue;
    matches.found.push_back({*std::move(belief), probability});
  }
  return matches;
}

Present presentOf(Map& map, const State& state, ObjectId id) {
  ObjectId now = id;
  const Ended* ended = endOf(state, id);
  for (std::size_t steps = 0; ended && ended->merged_into && steps < state.ended.size(); ++steps) {
    now = ended->merged_into;
    ended = endOf(state, now);
  }
  Present present;
  if (auto belief = beliefOf(map, now)) {
    present = {*belief, toJson(*belief, state)};
    present.json["status"] = "on_map";
  } else if (ended) {
    present = {ended->last, toJson(*ended, state)};
  } else {
    throw NoAnswer("The map has no object " + std::to_string(id) +
                   "; find_objects has the ids of those it has.");
  }
  if (now != id) present.json["merged_from"] = id;
  return present;
}

}  // namespace perdure::gateway::mcp
