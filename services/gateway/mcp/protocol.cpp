#include "services/gateway/mcp/protocol.h"

#include <algorithm>
#include <array>
#include <optional>

#include "services/gateway/mcp/tools.h"

namespace perdure::gateway::mcp {
namespace {

constexpr std::array kRevisions{"2025-06-18", "2025-03-26", "2024-11-05"};
enum ErrorCode : int {
  kParseError = -32700,
  kInvalidRequest = -32600,
  kMethodNotFound = -32601,
  kInvalidParams = -32602
};

struct RpcError {
  ErrorCode code;
  std::string message;
};

constexpr char kInstructions[] =
    "Perdure keeps a map of the objects that a vehicle with a camera has seen. Positions are in "
    "metres in the map's frame M (z up), times in seconds of the sensor clock; now_s is the "
    "newest. `probability` is that an object exists as of its last evidence, which is age_s old: "
    "objects can leave unseen. `evidence` has the log-odds that sum to log_odds = log(p / (1 - "
    "p)): "
    "prior (before the first box), hit, repeated (hits from the same place), miss (not detected "
    "although in view), screened (misses excused: something unmapped may hide it), hidden and away "
    "(not looked at; 0), time, misshapen, lost, shared, merge, restore, recall, person "
    "(corrections by people), and unexplained.";

Json errorOf(const Json& id, const RpcError& error) {
  return {{"jsonrpc", "2.0"},
          {"id", id},
          {"error", {{"code", error.code}, {"message", error.message}}}};
}

Json initialized(const Json& params) {
  const auto asked = params.find("protocolVersion");
  if (asked == params.end() || !asked->is_string()) {
    throw RpcError{kInvalidParams, "initialize needs protocolVersion, a text"};
  }
  const auto revision = asked->get<std::string>();
  return {{"protocolVersion", isKnownRevision(revision) ? revision : kRevisions.front()},
          {"capabilities", {{"tools", {{"listChanged", false}}}}},
          {"serverInfo",
           {{"name", "perdure"}, {"title", "Perdure's map"}, {"version", PERDURE_VERSION}}},
          {"instructions", kInstructions}};
}

Json called(const Json& params, Map& map) {
  const auto name = params.find("name");
  if (name == params.end() || !name->is_string()) {
    throw RpcError{kInvalidParams, "tools/call needs the name of a tool"};
  }
  const Json arguments = params.value("arguments", Json::object());
  if (!arguments.is_object()) throw RpcError{kInvalidParams, "arguments must be an object"};
  auto result = callTool(name->get<std::string>(), arguments, map);
  if (!result) {
    throw RpcError{kInvalidParams, "there is no tool " + name->get<std::string>() +
                                       "; tools/list has those there are"};
  }
  return *std::move(result);
}

Json resultOf(const std::string& method, const Json& params, Map& map) {
  if (method == "initialize") return initialized(params);
  if (method == "ping") return Json::object();
  if (method == "tools/list") return {{"tools", listTools(map)}};
  if (method == "tools/call") return called(params, map);
  throw RpcError{kMethodNotFound, "there is no method " + method};
}

bool isId(const Json& id) { return id.is_string() || id.is_number_integer(); }

/// Returns nothing for notifications and for responses of the client.
std::optional<Json> answerOne(const Json& message, Map& map) {
  const bool is_response = message.is_object() && !message.contains("method") &&
                           (message.contains("result") || message.contains("error"));
  if (is_response) return std::nullopt;
  const Json id = message.is_object() ? message.value("id", Json()) : Json();
  try {
    if (!message.is_object() || message.value("jsonrpc", Json()) != "2.0" ||
        !message.value("method", Json()).is_string()) {
      throw RpcError{kInvalidRequest, "a message has jsonrpc \"2.0\" and a method"};
    }
    if (!message.contains("id")) return std::nullopt;
    if (!isId(id)) throw RpcError{kInvalidRequest, "an id is a text or an integer"};
    const Json params = message.value("params", Json::object());
    if (!params.is_object()) throw RpcError{kInvalidParams, "params must be an object"};
    return Json{{"jsonrpc", "2.0"},
                {"id", id},
                {"result", resultOf(message["method"].get<std::string>(), params, map)}};
  } catch (const RpcError& error) {
    return errorOf(isId(id) ? id : Json(), error);
  }
}

std::string lineOf(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

bool isInvalid(const Json& answer) {
  return answer.contains("error") && answer["error"]["code"] == kInvalidRequest;
}

}  // namespace

bool isKnownRevision(std::string_view revision) {
  return std::ranges::find(kRevisions, revision) != kRevisions.end();
}

Answer answer(std::string_view message, Map& map) {
  const Json json = Json::parse(message, nullptr, false);
  if (json.is_discarded()) {
    return {400, lineOf(errorOf({}, {kParseError, "the message is not JSON"}))};
  }
  if (!json.is_array() || json.empty()) {
    const auto one = answerOne(json, map);
    if (!one) return {202, {}};
    return {isInvalid(*one) ? 400 : 200, lineOf(*one)};
  }
  Json answers = Json::array();
  for (const Json& each : json) {
    if (auto one = answerOne(each, map)) answers.push_back(*std::move(one));
  }
  return answers.empty() ? Answer{202, {}} : Answer{200, lineOf(answers)};
}

}  // namespace perdure::gateway::mcp
