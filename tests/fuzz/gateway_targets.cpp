// What clients of the gateway say, and what they ask.
#include <nlohmann/json.hpp>
#include <set>

#include "services/gateway/node.h"
#include "services/gateway/protocol/client_message.h"
#include "services/gateway/web/guard.h"
#include "services/gateway/web/hub.h"
#include "tests/fuzz/target.h"

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
  return seeds;
}

class Silent : public web::Viewer {
 public:
  Silent() : Viewer(8) {}
  void flush() override {}
  void cut(const std::string&) override { cut_ = true; }
  bool cut_ = false;
};

/// Whether it is JSON. What a hub offers is the same to each client, and parsed once.
bool isJson(const std::string& text) {
  static std::set<std::string> known;
  if (known.contains(text)) return true;
  if (!nlohmann::json::accept(text)) return false;
  if (known.size() < 16) known.insert(text);
  return true;
}

/// The first byte says whether it is text: all but 'b' do. What is taken goes through a hub with
/// one client.
bool takeSaid(View bytes) {
  if (bytes.empty()) return false;
  const bool text = bytes[0] != 'b';
  const View said = bytes.subspan(1);
  const std::string_view chars(reinterpret_cast<const char*>(said.data()), said.size());
  const auto message = text ? protocol::parseText(chars) : protocol::parseBinary(said);
  if (!message) require(!message.error().code.empty(), "a refusal has a reason");
  Channels wanted;
  web::Hub hub("perdure", "s", 8,
               {.wanted = [&](const Channels& c) { wanted = c; }, .call = [](Call) {}});
  static const auto channels = channelTable({"cam0"});
  static const auto services = serviceTable();
  hub.offer(channels, services);
  Silent viewer;
  hub.join(viewer);
  hub.hear(viewer, chars, text, {});
  require(viewer.outbox().size() <= 3 + 512, "what waits is bounded");
  while (const auto one = viewer.outbox().take()) {
    if (one->text) require(isJson(*one->payload), "what is said as text is JSON");
  }
  hub.leave(viewer);
  require(wanted.empty(), "nobody looks when all have left");
  return message.has_value();
}

/// A question to the map or about an object: an answer or a query to the store.
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

/// A Host and an Origin, in two lines: what is let in is a name of ours.
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
          {"gateway_headers", 18000, headerSeeds, takeHeaders}};
}

}  // namespace perdure::fuzz
