#include "services/gateway/mcp/tools.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "common/types/correction_json.h"
#include "common/types/ledger_json.h"
#include "services/gateway/mcp/looked.h"
#include "services/gateway/mcp/objects.h"

namespace perdure::gateway::mcp {
namespace {

Json answerOf(const State& state) {
  return {{"frame", "M"}, {"now_s", rounded(toSeconds(state.now))}};
}

/// Results with the times by which they are sorted.
using Timed = std::vector<std::pair<TimePoint, Json>>;

/// Puts the latest results, at most as many as the conditions allow.
void putLatest(Timed results, const Conditions& conditions, const char* name, Json& answer) {
  std::ranges::stable_sort(results, std::greater{}, &Timed::value_type::first);
  answer[name] = Json::array();
  for (auto& [time, json] : results) {
    if (answer[name].size() < conditions.limit) answer[name].push_back(std::move(json));
  }
}

/// Returns the number of matching objects to expect on the ground within the radius that was never
/// looked at, if that can be estimated.
std::optional<double> expectedUnseen(Map& map, const State& state, const Conditions& conditions) {
  if (!conditions.near) return std::nullopt;
  try {
    const Looked looked(map, state, conditions);
    const auto density = looked.density(conditions);
    if (!density) return std::nullopt;
    return *density * looked.unseenArea(*conditions.near, conditions.radius_m);
  } catch (const NoAnswer&) {
    return std::nullopt;  // the answer has null
  }
}

Json findObjects(const Json& arguments, Map& map) {
  const State state = map.begin();
  const Conditions conditions(arguments);
  const auto nearer = [&](const MapObject& a, const MapObject& b) {
    if (!conditions.near) return a.existence > b.existence;
    return (a.mean.head<2>() - *conditions.near).norm() <
           (b.mean.head<2>() - *conditions.near).norm();
  };
  Matches matches = matchesOf(map, conditions, nearer);
  std::ranges::stable_sort(matches.found, std::greater{}, &Match::probability);
  Json objects = Json::array(), none = Json::object();
  double log_none = 0.0;  // log-probability that no object matches
  const auto add = [&](const std::string& what, double log_probability) {
    none[what] = rounded(log_probability);
    log_none += log_probability;
  };
  for (const Match& match : matches.found) {
    constexpr double kMost = 1.0 - 1e-15;
    add(std::to_string(match.belief.id), std::log1p(-std::min(match.probability, kMost)));
    if (objects.size() == conditions.limit) continue;
    objects.push_back(toJson(match.belief, state));
    objects.back()["match_probability"] = rounded(match.probability);
  }
  const auto unseen = expectedUnseen(map, state, conditions);
  if (unseen) add("unseen_ground", -*unseen);
  Json answer = answerOf(state);
  answer["probability"] = rounded(-std::expm1(log_none));
  answer["log_none"] = none;
  answer["expected_unseen"] = unseen ? Json(rounded(*unseen)) : Json();
  answer["objects"] = objects;
  answer["truncated"] = matches.truncated || matches.found.size() > conditions.limit;
  return answer;
}

Json whereLastSeen(const Json& arguments, Map& map) {
  const State state = map.begin();
  const Conditions conditions(arguments);
  Json answer = answerOf(state);
  if (arguments.contains("id")) {
    answer["objects"] = Json::array({presentOf(map, state, arguments["id"]).json});
    return answer;
  }
  if (!conditions.namesClass() && !conditions.near) {
    throw NoAnswer("give id, class, text, or near with radius_m");
  }
  Timed results;
  const Matches matches = matchesOf(map, conditions, [](const MapObject& a, const MapObject& b) {
    return a.last_seen > b.last_seen;
  });
  for (const Match& match : matches.found) {
    results.emplace_back(match.belief.last_seen, toJson(match.belief, state));
    results.back().second["status"] = "on_map";
  }
  for (const Ended& ended : state.ended) {
    if (ended.kind == EventKind::kMerged || !conditions.admits(ended.last)) continue;
    results.emplace_back(ended.last.last_seen, toJson(ended, state));
  }
  putLatest(std::move(results), conditions, "objects", answer);
  return answer;
}

Json why(const Json& arguments, Map& map) {
  const State state = map.begin();
  const Present present = presentOf(map, state, arguments["id"]);
  const Json ledger = present.belief.why.empty() ? Json::object() : toJson(present.belief.why);
  Json answer = answerOf(state);
  answer["object"] = present.json;
  answer["classes"] = Json::array();
  for (const ClassBelief& each : present.belief.classes) {
    answer["classes"].push_back(
        {{"class", each.name},
         {"probability", rounded(each.probability)},
         {"evidence", ledger.value("classes", Json::object()).value(each.name, Json::object())}});
  }
  answer["ousted"] = ledger.value("ousted", Json::array());
  return answer;
}

Json whatChanged(const Json& arguments, Map& map) {
  const State state = map.begin();
  const Conditions conditions(arguments);
  const TimePoint since = conditions.changed_since;
  Timed results;
  const Matches appeared = matchesOf(
      map, conditions,
      [](const MapObject& a, const MapObject& b) { return a.first_seen > b.first_seen; }, since);
  for (const Match& match : appeared.found) {
    results.emplace_back(match.belief.first_seen, toJson(match.belief, state));
    results.back().second["change"] = "appeared";
  }
  for (const Ended& ended : state.ended) {
    if (ended.kind == EventKind::kMerged || ended.time < since) continue;
    if (!conditions.admits(ended.last)) continue;
    results.emplace_back(ended.time, toJson(ended, state));
    results.back().second["change"] = perdure::nameOf(ended.kind);
  }
  for (auto& [time, json] : results) json["time_s"] = rounded(toSeconds(time));
  Json answer = answerOf(state);
  answer["truncated"] = appeared.truncated || results.size() > conditions.limit;
  answer["ended_from_s"] = state.ended_from ? Json(rounded(toSeconds(*state.ended_from))) : Json();
  putLatest(std::move(results), conditions, "changes", answer);
  return answer;
}

Json neverSeen(const Json& arguments, Map& map) {
  const State state = map.begin();
  const Conditions conditions(arguments);
  const Looked looked(map, state, conditions);
  const auto density = looked.density(conditions);
  Json answer = answerOf(state);
  answer["reach_m"] = rounded(looked.reach());
  answer["unseen_m2"] = rounded(looked.unseenArea(*conditions.near, conditions.radius_m));
  answer["regions"] = Json::array();
  for (const auto& region : looked.unseen(*conditions.near, conditions.radius_m)) {
    if (answer["regions"].size() == conditions.limit) break;
    const double log_odds = logOdds(region.share);
    const Json views{{"log_odds", rounded(log_odds)}, {"count", looked.anchors()}};
    answer["regions"].push_back(
        {{"centre_m", Json::array({rounded(region.centre.x()), rounded(region.centre.y())})},
         {"area_m2", rounded(region.area_m2)},
         {"probability", rounded(region.share)},
         {"log_odds", rounded(log_odds)},
         {"evidence", {{"views", views}}},
         {"age_s", nullptr},
         {"expected_objects",
          density ? Json(rounded(*density * region.area_m2 * region.share)) : Json()}});
  }
  return answer;
}

/// Returns the present state of an object; null if the map does not have it, or gives no answer.
Json presentOrNull(Map& map, const State& state, ObjectId id) {
  try {
    return presentOf(map, state, id).json;
  } catch (const std::runtime_error&) {  // NoAnswer, or StartupError of a file
    return nullptr;
  }
}

Json correctMap(const Json& arguments, Map& map) {
  auto correction = correctionOf(arguments);
  if (!correction) throw NoAnswer(std::string("correct as ") + kCorrectionForms);
  if (correction->author.empty()) correction->author = "assistant";
  const Correction made = map.correct(*correction);
  const State state = map.begin();
  Json answer = answerOf(state);
  answer["correction"] = perdure::toJson(made);
  answer["object"] = presentOrNull(map, state, made.object);
  return answer;
}

/// The schema of objects, changes and regions in answers.
Json itemSchema() {
  return Json::parse(R"({"type": "object", "properties": {
    "id": {"type": "integer"}, "class": {"type": "string"},
    "probability": {"type": "number", "minimum": 0, "maximum": 1},
    "log_odds": {"type": "number"},
    "evidence": {"type": "object", "additionalProperties": {"type": "object",
      "properties": {"log_odds": {"type": "number"}}, "required": ["log_odds"]},
      "description": "entries that sum to log_odds"},
    "age_s": {"type": ["number", "null"], "description": "since the last evidence; null: never"}},
    "required": ["probability", "log_odds", "evidence", "age_s"]})");
}

Json resultSchema(const char* list, bool or_null) {
  Json properties{{"frame", {{"type", "string"}}}, {"now_s", {{"type", "number"}}}};
  const bool single = std::string(list) == "object";
  properties[list] = single ? itemSchema() : Json{{"type", "array"}, {"items", itemSchema()}};
  if (or_null) properties[list]["type"] = Json::array({"object", "null"});
  return {{"type", "object"}, {"properties", properties}, {"required", {"frame", "now_s", list}}};
}

struct Tool {
  const char *name, *description;
  Json input;
  const char* list;  ///< the member of the result with its items
  Json (*run)(const Json& arguments, Map& map);
  bool writes = false;  ///< only for maps that take corrections
};

const std::vector<Tool>& tools() {
  static const std::vector<Tool> all{
      {"find_objects",
       "Finds objects by class, text, place and time. `probability` is that at least one object "
       "matches, also on ground within the radius that was never looked at (`expected_unseen` "
       "objects; null: not known). `log_none` has entries that sum to log(1 - probability). "
       "`match_probability` is that an object exists, has the class and lies within the radius.",
       schemaOfArguments({"class", "text", "near", "radius_m", "seen_since_s", "seen_until_s",
                          "min_probability", "limit"},
                         {}),
       "objects", findObjects},
      {"where_last_seen",
       "Where and when an object, or the objects of a class, were last seen, the latest first. "
       "Includes objects that are gone.",
       schemaOfArguments({"id", "class", "text", "near", "radius_m", "limit"}, {}), "objects",
       whereLastSeen},
      {"why",
       "The evidence for one object: the entries that sum to the log-odds of its existence, and "
       "for each class those that sum to the logarithm of its probability.",
       schemaOfArguments({"id"}, {"id"}), "object", why},
      {"what_changed",
       "Objects that appeared, moved or are gone since a time, the latest first. `appeared` means "
       "seen for the first time. Before `ended_from_s`, objects that ended may be missing.",
       schemaOfArguments({"since_s", "class", "text", "near", "radius_m", "limit"}, {"since_s"}),
       "changes", whatChanged},
      {"never_seen",
       "Regions of the ground near a place that no camera has looked at, largest first, with the "
       "number of objects to expect there. Walls are not on the map: ground behind them may count "
       "as looked at.",
       schemaOfArguments({"near", "radius_m", "class", "text", "limit"}, {"near", "radius_m"}),
       "regions", neverSeen},
      {"correct",
       "Corrects the map, if a person asks for it: an object is not there, has another class, or "
       "two objects are the same or different. Or withdraws the correction with a number. `object` "
       "has the evidence afterwards, with the entry `person`; null: it is not on the map.",
       schemaOfArguments({"object", "kind", "class", "other", "nats", "author", "withdraw"}, {}),
       "object", correctMap, true}};
  return all;
}

Json resultOf(const Tool& tool, const Json& arguments, Map& map) {
  try {
    checkArguments(arguments, tool.input);
    const Json answer = tool.run(arguments, map);
    const std::string text = answer.dump(-1, ' ', false, Json::error_handler_t::replace);
    return {{"content", Json::array({{{"type", "text"}, {"text", text}}})},
            {"structuredContent", answer},
            {"isError", false}};
  } catch (const std::runtime_error& error) {  // NoAnswer, or StartupError of a file
    return {{"content", Json::array({{{"type", "text"}, {"text", error.what()}}})},
            {"isError", true}};
  }
}

}  // namespace

Json listTools(const Map& map) {
  Json list = Json::array();
  for (const Tool& tool : tools()) {
    if (tool.writes && !map.takesCorrections()) continue;
    list.push_back({{"name", tool.name},
                    {"description", tool.description},
                    {"inputSchema", tool.input},
                    {"outputSchema", resultSchema(tool.list, tool.writes)},
                    {"annotations", {{"readOnlyHint", !tool.writes}, {"openWorldHint", false}}}});
  }
  return list;
}

std::optional<Json> callTool(const std::string& name, const Json& arguments, Map& map) {
  const auto tool = std::ranges::find(tools(), name, &Tool::name);
  if (tool == tools().end() || (tool->writes && !map.takesCorrections())) return std::nullopt;
  return resultOf(*tool, arguments, map);
}

}  // namespace perdure::gateway::mcp
