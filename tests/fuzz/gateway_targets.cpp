// Targets: messages and requests of the gateway's clients.
#include <nlohmann/json.hpp>
#include <set>

#include "common/wire/cdr.h"
#include "services/gateway/mcp/protocol.h"
#include "services/gateway/node.h"
#include "services/gateway/protocol/client_message.h"
#include "services/gateway/web/guard.h"
#include "services/gateway/web/hub.h"
#include "tests/common/wire/examples.h"
#include "tests/fuzz/target.h"
#include "tests/services/gateway/mcp/town.h"

namespace perdure::fuzz {
namespace {

using namespace gateway;

std::vector<Bytes> saidSeeds() {
  std::vector<Bytes> seeds;
  for (const char* text :
       {R"({"op":"subscribe","subscriptions":[{"id":1,"channelId":2},{"id":7,"channelId":100}]})",
        R"({"op":"unsubscribe","subscriptionIds":[1,7]})", R"({"op":"getParameters","id":"a"})",
        R"({"op":"fetchAsset","requestId":3,"uri":"package://x"})", R"({"op":"advertise"})"}) {
    seeds.push_back(bytesOf(std::string("t") + text));
  }
  Bytes call{'b', 2, 1, 0, 0, 0, 9, 0, 0, 0, 4, 0, 0, 0, 'j', 's', 'o', 'n'};
  for (const char c : std::string(R"({"id":12})")) call.push_back(static_cast<std::uint8_t>(c));
  seeds.push_back(call);
  // Play at twice the speed from 5 ns on; pause.
  for (const char first : {'b', 'p'}) {
    const auto opcode = static_cast<std::uint8_t>(first);
    seeds.push_back({opcode, 3, 0, 0, 0, 0, 64, 1, 5, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 'r'});
    seeds.push_back({opcode, 3, 1, 0, 0, 128, 63, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0});
  }
  return seeds;
}

class Silent : public web::Viewer {
 public:
  Silent() : Viewer(8) {}
  void flush() override {}
  void cut(const std::string&) override { cut_ = true; }
  bool cut_ = false;
};

/// Returns whether the text is JSON. Caches texts, because the hub offers the same ones to each
/// client.
bool isJson(const std::string& text) {
  static std::set<std::string> known;
  if (known.contains(text)) return true;
  if (!nlohmann::json::accept(text)) return false;
  if (known.size() < 16) known.insert(text);
  return true;
}

/// Checks a client's playback request and answers it.
void obey(web::Hub& hub, const PlaybackRequest& request) {
  require(request.speed >= 0.01 && request.speed <= 100.0, "a speed is bounded");
  require(!request.seek || toNanoseconds(*request.seek) >= 0, "a time to seek is one");
  require(request.id.size() <= 128, "an id is bounded");
  hub.tellPlayback({PlaybackState::Status::kPlaying, request.seek.value_or(TimePoint()),
                    request.speed, request.seek.has_value(), request.id});
}

/// The first byte selects the kind: 'b' binary, 'p' binary for a hub with a played recording, any
/// other byte text. The message goes through a hub with one client.
bool takeSaid(View bytes) {
  if (bytes.empty()) return false;
  const bool text = bytes[0] != 'b' && bytes[0] != 'p';
  const View said = bytes.subspan(1);
  const std::string_view chars(reinterpret_cast<const char*>(said.data()), said.size());
  const auto message = text ? protocol::parseText(chars) : protocol::parseBinary(said);
  if (!message) require(!message.error().code.empty(), "a refusal has a reason");
  Channels wanted;
  std::optional<PlaybackRequest> request;
  web::Hub::Told told{.wanted = [&](const Channels& c) { wanted = c; }, .call = [](Call) {}};
  if (bytes[0] == 'p') told.playback = [&](const PlaybackRequest& r) { request = r; };
  web::Hub hub("perdure", "s", 8, told);
  static const auto channels = channelTable({"cam0"});
  static const auto services = serviceTable();
  hub.offer(channels, services);
  Silent viewer;
  hub.join(viewer);
  hub.hear(viewer, chars, text, {});
  if (request) obey(hub, *request);
  require(viewer.outbox().size() <= 3 + 512, "what waits is bounded");
  while (const auto one = viewer.outbox().take()) {
    if (one->text) require(isJson(*one->payload), "what is said as text is JSON");
  }
  hub.leave(viewer);
  require(wanted.empty(), "nobody looks when all have left");
  return message.has_value();
}

/// A request about the map or an object gives an answer or a query to the store.
bool takeQuestion(View bytes) {
  if (bytes.empty()) return false;
  int answers = 0, queries = 0;
  Node node({}, "ego", 1,
            {.message = [](const Encoded&) {},
             .time = [](const TimePoint&) {},
             .answer =
                 [&](const Answer& answer) {
                   require(!answer.ok, "without objects there is nothing to tell");
                   ++answers;
                 },
             .query =
                 [&](const MapQuery& query) {
                   require(query.limit > 0 && query.limit <= 1000 && query.low.allFinite(),
                           "a query is sound");
                   ++queries;
                 }});
  const std::uint32_t service = bytes[0] % 2 == 0 ? kObjectService : kMapQueryService;
  node.onCall({1, service, 1, textOf(bytes.subspan(1))}, 1);
  require(answers + queries == 1, "a question is answered or asked on");
  return queries == 1;
}

std::vector<Bytes> questionSeeds() {
  std::vector<Bytes> seeds;
  for (const char* text :
       {"0{\"id\":12}", "1{\"class\":\"car\",\"limit\":3}", "1{}",
        "1{\"near\":[1,2,3],\"radius\":20}", "1{\"low\":[0,0,0],\"high\":[1,1.5,2e3]}"}) {
    seeds.push_back(bytesOf(text));
  }
  return seeds;
}

/// A reply of map_store about the graph, to a gateway with a client that views the graph.
bool takeGraphReply(View bytes) {
  const auto keeper = std::make_shared<Bytes>(bytes.begin(), bytes.end());
  auto reply = wire::decodeCdr<MapReply>(*keeper, keeper);
  if (!reply) return false;
  int told = 0;
  Node node({}, "ego", 1,
            {.message =
                 [&](const Encoded& message) {
                   require(nlohmann::json::accept(*message.payload), "what is told is JSON");
                   ++told;
                 },
             .time = [](const TimePoint&) {},
             .answer = [](const Answer&) { require(false, "nobody asked"); },
             .query =
                 [&](const MapQuery& query) {
                   require(query.kind == MapQueryKind::kGraph && query.limit > 0,
                           "the graph is asked for");
                   reply->client = query.client, reply->request = query.request;
                 }});
  node.setWanted({kMapGraph, kMapGraphScene});
  node.tick(1);
  for (MapAnchor& anchor : reply->anchors) anchor.map = {};  // the displayed map
  node.onMapReply(*reply);
  require(!reply->ok || told == 2, "who looks is told");
  return reply->ok && !reply->anchors.empty();
}

std::vector<Bytes> graphReplySeeds() {
  std::vector<Bytes> seeds;
  for (unsigned seed = 1; seeds.size() < 3; ++seed) {
    MapReply reply;
    wire::Examples(seed).fill(reply);
    reply.ok = true;
    if (reply.anchors.size() < 2 || reply.loops.empty()) continue;
    reply.loops[0].a = reply.anchors[0].id, reply.loops[0].b = reply.anchors[1].id;
    reply.anchors[1].previous = reply.anchors[0].id;
    reply.objects.clear(), reply.beliefs.clear();
    seeds.push_back(wire::encodeCdr(reply).value());
  }
  return seeds;
}

/// A message of an MCP client about a map in memory.
bool takeMcpMessage(View bytes) {
  static test::Town town;
  const mcp::Answer answer = mcp::answer(textOf(bytes), town);
  require(answer.text.empty() == (answer.status == 202), "each request is answered");
  require(answer.text.find('\n') == std::string::npos, "an answer is one line");
  if (answer.text.empty()) return true;
  const auto json = nlohmann::json::parse(answer.text, nullptr, false);
  require(!json.is_discarded(), "an answer is JSON");
  return json.contains("result") && !json["result"].value("isError", false);
}

std::vector<Bytes> mcpSeeds() {
  std::vector<Bytes> seeds{bytesOf(R"({"jsonrpc":"2.0","method":"notifications/initialized"})"),
                           bytesOf(R"({"jsonrpc":"2.0","id":1,"method":"initialize","params":)"
                                   R"({"protocolVersion":"2025-06-18"}})"),
                           bytesOf(R"({"jsonrpc":"2.0","id":"a","method":"tools/list"})")};
  for (const char* call :
       {R"("find_objects","arguments":{"text":"red cars","near":[10,5.5],"radius_m":20,"limit":3})",
        R"("where_last_seen","arguments":{"id":5})", R"("why","arguments":{"id":1})",
        R"("what_changed","arguments":{"since_s":-3.5,"class":"car"})",
        R"("never_seen","arguments":{"near":[-30,0],"radius_m":5})"}) {
    seeds.push_back(bytesOf(std::string(R"({"jsonrpc":"2.0","id":2,"method":"tools/call",)"
                                        R"("params":{"name":)") +
                            call + "}}"));
  }
  return seeds;
}

/// A Host and an Origin header, in two lines. Only names of this machine are accepted.
bool takeHeaders(View bytes) {
  const std::string text = textOf(bytes);
  const std::size_t line = text.find('\n');
  const std::string host = text.substr(0, line);
  const std::string origin = line == std::string::npos ? "" : text.substr(line + 1);
  const web::Guard guard(web::Options{});
  const bool host_ok = guard.checkHost(host).has_value();
  if (host_ok) require(web::isLoopback(web::hostName(host)), "no other name is let in");
  const bool origin_ok = guard.checkOrigin(origin, host).has_value();
  return host_ok && origin_ok;
}

std::vector<Bytes> headerSeeds() {
  return {bytesOf("127.0.0.1:8765\nhttp://127.0.0.1:8765"), bytesOf("localhost\n"),
          bytesOf("[::1]:8765\nhttps://app.foxglove.dev")};
}

}  // namespace

std::vector<Target> gatewayTargets() {
  return {{"gateway_said", 9000, saidSeeds, takeSaid},
          {"gateway_question", 6000, questionSeeds, takeQuestion},
          {"gateway_graph", 4200, graphReplySeeds, takeGraphReply},
          {"gateway_mcp", 3000, mcpSeeds, takeMcpMessage},
          {"gateway_headers", 18000, headerSeeds, takeHeaders}};
}

}  // namespace perdure::fuzz
