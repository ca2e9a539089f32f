// Tests perdure-gateway as a process: its services, its rejections, and the effect of hostile
// clients on it and on other clients.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>

#include "common/bus/topics.h"
#include "common/bus/wait_loop.h"
#include "tests/process/support.h"
#include "tests/services/gateway/objects.h"
#include "tests/services/gateway/raw_client.h"

namespace perdure::gateway::test {
namespace {

using namespace std::chrono_literals;
using namespace perdure::test;
using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::Not;

std::string subscribe(std::uint32_t id, std::uint32_t channel) {
  return json{{"op", "subscribe"}, {"subscriptions", {{{"id", id}, {"channelId", channel}}}}}
      .dump();
}

Frame greyFrame(std::uint64_t sequence) {
  Frame frame;
  frame.stamp = frameOf(sequence, {}).stamp;
  frame.camera = "cam0";
  frame.width = 64, frame.height = 48;
  frame.data = std::make_shared<const std::vector<std::uint8_t>>(64 * 48, std::uint8_t{90});
  return frame;
}

class Gateway : public ::testing::Test {
 protected:
  void start(std::vector<std::string> settings = {}) {
    std::vector<std::string> command{(programs() / "perdure-gateway").string(), "--port", "0"};
    for (const std::string& setting : settings) command.insert(command.end(), {"--set", setting});
    child_ = std::make_unique<Child>(command, folder_.file("log"));
    const std::regex pattern("http://[^:]*:([0-9]+)/");
    std::smatch found;
    ASSERT_TRUE(eventually(20s, [&] {
      const std::string log = child_->log();
      if (!std::regex_search(log, found, pattern)) return false;
      port_ = static_cast<std::uint16_t>(std::stoi(found[1]));
      return true;
    })) << child_->log();
    ASSERT_TRUE(eventually(20s, [&] { return events_.matched() > 0; })) << child_->log();
  }

  /// Returns a client after the handshake; stores the channel ids by topic.
  std::unique_ptr<RawClient> greeted() {
    auto client = std::make_unique<RawClient>(port_);
    EXPECT_THAT(client->upgrade(), HasSubstr("101")) << child_->log();
    for (int i = 0; i < 3; ++i) {
      const json message = json::parse(client->readFrame().payload, nullptr, false);
      if (!message.is_object() || message["op"] != "advertise") continue;
      for (const auto& channel : message["channels"]) channels_[channel["topic"]] = channel["id"];
    }
    return client;
  }
  std::unique_ptr<RawClient> lookingAt(const std::string& topic) {
    auto client = greeted();
    client->sendFrame(subscribe(1, channels_[topic]));
    return client;
  }
  void publish(std::uint64_t sequence, std::size_t objects = 3) {
    std::vector<ObjectBelief> beliefs;
    for (ObjectId id = 1; id <= objects; ++id)
      beliefs.push_back(
          objectAt(id, {5.0 * static_cast<double>(id), 0.01 * static_cast<double>(sequence), 0}));
    ASSERT_TRUE(objects_.write(frameOf(sequence, beliefs)).has_value());
  }
  /// Returns a count of /metrics; 0 if it is missing.
  double metric(const std::string& name) const {
    const std::string text = get(port_, "/metrics").text;
    const auto at = text.find("\n" + name + " ");
    return at == std::string::npos ? 0 : std::stod(text.substr(at + name.size() + 2));
  }
  double refused(const std::string& reason) const {
    return metric("perdure_gateway_refused_total{reason=\"" + reason + "\"}");
  }
  /// Checks that the gateway still serves other clients.
  void serves() {
    const auto client = lookingAt("/objects");
    publish(++sequence_);
    EXPECT_THAT(client->readMessage(1), HasSubstr("\"objects\":[{\"id\":1")) << child_->log();
  }

  bus::Domain domain_{ownNetwork()};
  bus::Participant participant_{domain_, "test"};
  bus::Writer<Objects> objects_{participant_, bus::kTopic<Objects>};
  bus::Writer<Event> events_{participant_, bus::kTopic<Event>};
  Folder folder_;
  std::unique_ptr<Child> child_;
  std::uint16_t port_ = 0;
  std::map<std::string, std::uint32_t> channels_;
  std::uint64_t sequence_ = 1;
};

TEST_F(Gateway, ServesPageHealthAndMetrics) {
  std::filesystem::create_directories(folder_.file("page"));
  std::ofstream(folder_.file("page/index.html")) << "<title>the page</title>";
  start({"page.folder=" + folder_.file("page")});
  const HttpAnswer page = get(port_, "/");
  EXPECT_EQ(page.status, 200);
  EXPECT_THAT(page.text, HasSubstr("<title>the page</title>"));
  EXPECT_THAT(page.text, HasSubstr("Content-Security-Policy: default-src 'self'"));
  std::smatch tag;
  ASSERT_TRUE(std::regex_search(page.text, tag, std::regex("ETag: (\"[^\"]*\")")));
  EXPECT_EQ(get(port_, "/", "If-None-Match: " + tag[1].str() + "\r\n").status, 304);
  EXPECT_EQ(get(port_, "/../../etc/passwd").status, 404);
  EXPECT_EQ(get(port_, "/nothing").status, 404);
  ASSERT_TRUE(eventually(5s, [&] {
    return get(port_, "/healthz").text.find("\"gateway\":\"ok\"") != std::string::npos;
  })) << get(port_, "/healthz").text;
  EXPECT_THAT(get(port_, "/metrics").text, Not(HasSubstr("perdure_gateway_objects")))
      << "nobody looks: it is not known";
  const auto client = lookingAt("/objects");
  publish(1);
  EXPECT_TRUE(eventually(5s, [&] { return metric("perdure_gateway_objects") == 3; }));
  EXPECT_THAT(get(port_, "/metrics").text, HasSubstr("perdure_service_up{process=\"gateway\"} 1"));
}

TEST_F(Gateway, SaysInHealthWhereItIsAndForHowMany) {
  start();
  const auto client = lookingAt("/health");
  bus::Reader<Health> healths(participant_, bus::kTopic<Health>);
  std::string message;
  const std::string expected = "at http://127.0.0.1:" + std::to_string(port_) + "/ for 1 clients";
  EXPECT_TRUE(eventually(10s, [&] {
    healths.drain([&](const Health& health) { message = health.message; });
    return message == expected;
  })) << message;
}

TEST_F(Gateway, ServesTheLayoutForItsOwnCamera) {
  std::filesystem::create_directories(folder_.file("page"));
  std::ofstream(folder_.file("page/index.html")) << "<title>the page</title>";
  std::filesystem::copy_file(sources() / "tools/viewer/src/foxglove_layout.json",
                             folder_.file("page/foxglove_layout.json"));
  start({"page.folder=" + folder_.file("page"), "image.cameras=[front]"});
  const std::string layout = get(port_, "/foxglove_layout.json").text;
  EXPECT_THAT(layout, HasSubstr("\"/camera/front/image\""));
  EXPECT_THAT(layout, Not(HasSubstr("cam0")));
}

TEST_F(Gateway, RefusesATruthThatThePageCannotShow) {
  std::filesystem::create_directories(folder_.file("page"));
  std::ofstream(folder_.file("page/index.html")) << "<title>the page</title>";
  const std::string truth = folder_.file("true.json");
  const auto refusalOf = [&](const std::string& text, int status) {
    std::ofstream(truth) << text;
    Child gateway({(programs() / "perdure-gateway").string(), "--port", "0", "--set",
                   "page.folder=" + folder_.file("page"), "--set", "page.truth=" + truth},
                  folder_.file("refused"));
    EXPECT_EQ(gateway.wait(20s), status) << gateway.log();
    return gateway.log();
  };
  EXPECT_THAT(refusalOf("", 69), HasSubstr("cannot be read"));
  EXPECT_THAT(refusalOf("{\"path\": [", 65), HasSubstr("is not JSON"));
  EXPECT_THAT(refusalOf(R"({"path": [], "objects": []})", 69), HasSubstr("has no truth.json"));
}

TEST_F(Gateway, SaysInOneSentenceWhereThereIsNoPage) {
  start({"page.folder=" + folder_.file("absent")});
  EXPECT_THAT(get(port_, "/").text, HasSubstr("The page was not built"));
}

TEST_F(Gateway, RefusesForeignHostsPagesAndProtocols) {
  start();
  EXPECT_EQ(get(port_, "/", "", "evil.example").status, 421);
  EXPECT_EQ(get(port_, "/healthz", "", "").status, 421);
  EXPECT_THAT(RawClient(port_).upgrade("Origin: https://evil.example\r\n"), HasSubstr(" 403 "));
  EXPECT_THAT(RawClient(port_).upgrade("Origin: null\r\n"), HasSubstr(" 403 "));
  EXPECT_THAT(RawClient(port_).upgrade("", "chat"), HasSubstr(" 400 "));
  EXPECT_THAT(RawClient(port_).upgrade("", ""), HasSubstr(" 400 "));
  EXPECT_THAT(RawClient(port_).upgrade("", "foxglove.websocket.v1, foxglove.sdk.v1"),
              HasSubstr("Sec-WebSocket-Protocol: foxglove.sdk.v1\r\n"));
  EXPECT_THAT(RawClient(port_).upgrade("Origin: https://app.foxglove.dev\r\n"), HasSubstr(" 101 "));
  RawClient post(port_);
  post.send("POST / HTTP/1.1\r\nHost: localhost\r\nContent-Length: 0\r\n\r\n");
  EXPECT_THAT(post.readHead(), HasSubstr(" 405 "));
  EXPECT_TRUE(eventually(5s, [&] {
    return refused("origin_refused") == 2 && refused("host_refused") == 2;
  })) << get(port_, "/metrics").text;
  serves();
}

TEST_F(Gateway, AnswersMcpClientsThatHaveTheToken) {
  start({"http.token=s3cret"});
  const std::string bearer = "Authorization: Bearer s3cret\r\n";
  const std::string ping = R"({"jsonrpc":"2.0","id":1,"method":"ping"})";
  EXPECT_EQ(post(port_, "/mcp", ping).status, 401);
  EXPECT_EQ(post(port_, "/mcp", ping, bearer + "Origin: http://evil.example\r\n").status, 403);
  const HttpAnswer answer = post(port_, "/mcp", ping, bearer);
  EXPECT_EQ(answer.status, 200);
  EXPECT_THAT(answer.text, HasSubstr("Content-Type: application/json"));
  EXPECT_THAT(answer.text, HasSubstr(R"({"jsonrpc":"2.0","id":1,"result":{}})"));
  EXPECT_EQ(post(port_, "/mcp?token=s3cret", ping).status, 200);
  const std::string notice = R"({"jsonrpc":"2.0","method":"notifications/initialized"})";
  EXPECT_EQ(post(port_, "/mcp", notice, bearer).status, 202);
  EXPECT_EQ(post(port_, "/mcp", "{", bearer).status, 400);
  EXPECT_EQ(post(port_, "/mcp", ping, bearer + "MCP-Protocol-Version: 1.0\r\n").status, 400);
  EXPECT_EQ(post(port_, "/mcp", ping, bearer + "MCP-Protocol-Version: 2025-06-18\r\n").status, 200);
  for (const char* method : {"GET", "DELETE"}) {
    EXPECT_EQ(ask(port_, std::string(method) + " /mcp", bearer, "127.0.0.1").status, 405) << method;
  }
  EXPECT_EQ(post(port_, "/mcp", std::string(100 << 10U, ' '), bearer).status, 0) << "too large";
  const std::string call = R"({"jsonrpc":"2.0","id":2,"method":"tools/call",)"
                           R"("params":{"name":"find_objects","arguments":{}}})";
  EXPECT_THAT(post(port_, "/mcp", call, bearer).text, HasSubstr("start perdure-map-store"));
}

TEST_F(Gateway, WantsTheTokenThatIsSet) {
  start({"http.token=s3cret"});
  EXPECT_THAT(RawClient(port_).upgrade(), HasSubstr(" 401 "));
  EXPECT_THAT(RawClient(port_).upgrade("", "foxglove.sdk.v1", "vehicle.example", "/?token=s3cret"),
              HasSubstr(" 101 "));
  EXPECT_EQ(get(port_, "/metrics").status, 401);
  EXPECT_EQ(get(port_, "/metrics?token=s3cret").status, 200);
}

TEST_F(Gateway, HasTheImagesSentToItOnlyWhileSomebodyLooks) {
  start();
  bus::Writer<Frame> frames(participant_, bus::frameTopic("cam0"));
  const auto client = greeted();
  EXPECT_EQ(frames.matched(), 0u);
  client->sendFrame(subscribe(4, channels_["/camera/cam0/image"]));
  ASSERT_TRUE(eventually(10s, [&] { return frames.matched() > 0; }));
  ASSERT_TRUE(frames.write(greyFrame(1)).has_value());
  EXPECT_THAT(client->readMessage(4), HasSubstr("\xff\xd8\xff"));
  client->sendFrame(R"({"op":"unsubscribe","subscriptionIds":[4]})");
  EXPECT_TRUE(eventually(10s, [&] { return frames.matched() == 0; }));
  client->sendFrame(subscribe(5, channels_["/camera/cam0/image"]));
  EXPECT_TRUE(eventually(10s, [&] { return frames.matched() == 1; }));
}

TEST_F(Gateway, HasNothingThatIsFrequentSentToItWhileNobodyLooks) {
  start();
  bus::Writer<Odometry> odometry(participant_, bus::kTopic<Odometry>);
  auto client = greeted();
  publish(++sequence_);
  EXPECT_EQ(objects_.matched() + odometry.matched(), 0u);
  client->sendFrame(subscribe(1, channels_["/scene"]));
  EXPECT_TRUE(eventually(10s, [&] { return objects_.matched() == 1 && odometry.matched() == 1; }));
  client->sendFrame(R"({"op":"unsubscribe","subscriptionIds":[1]})");
  EXPECT_TRUE(eventually(10s, [&] { return objects_.matched() + odometry.matched() == 0; }));
}

/// The drive has ended before the first client subscribes. Objects, body and image are those of its
/// last frame.
TEST_F(Gateway, TellsTheEndOfADriveToWhoComesAfterIt) {
  start();
  bus::Writer<Frame> frames(participant_, bus::frameTopic("cam0"));
  for (int i = 0; i < 3; ++i) {
    publish(++sequence_);
    ASSERT_TRUE(frames.write(greyFrame(sequence_)).has_value());
  }
  const auto client = greeted();
  client->sendFrame(subscribe(1, channels_["/objects"]));
  const std::string objects = client->readMessage(1);
  EXPECT_THAT(objects, HasSubstr("\"objects\":[{\"id\":1"));
  EXPECT_THAT(objects, HasSubstr("\"latency_ms\":-1")) << "it is not of now";
  client->sendFrame(subscribe(2, channels_["/pose"]));
  EXPECT_THAT(client->readMessage(2), HasSubstr("\"pose\""));
  client->sendFrame(subscribe(3, channels_["/camera/cam0/image"]));
  EXPECT_THAT(client->readMessage(3), HasSubstr("\xff\xd8\xff"));
}

/// No other message arrives that could make the gateway notice the new subscriber.
TEST_F(Gateway, TellsTheLastImageWhereThereAreNoObjects) {
  start();
  bus::Writer<Frame> frames(participant_, bus::frameTopic("cam0"));
  ASSERT_TRUE(frames.write(greyFrame(1)).has_value());
  const auto client = lookingAt("/camera/cam0/image");
  EXPECT_THAT(client->readMessage(1), HasSubstr("\xff\xd8\xff"));
}

/// Like a page that is reloaded while no new messages arrive.
TEST_F(Gateway, TellsTheLastStateToWhoLeavesAndComesAtOnce) {
  start();
  const auto client = lookingAt("/objects");
  publish(++sequence_);
  EXPECT_THAT(client->readMessage(1), HasSubstr("\"objects\""));
  for (std::uint32_t id = 2; id < 12; ++id) {
    const std::string leaves = json{{"op", "unsubscribe"}, {"subscriptionIds", {id - 1}}}.dump();
    client->send(RawClient::masked(leaves) +
                 RawClient::masked(subscribe(id, channels_["/objects"])));
    ASSERT_THAT(client->readMessage(id), HasSubstr("\"objects\"")) << id;
  }
}

TEST_F(Gateway, LosesNothingOfOneClientThroughAnotherThatDoesNotRead) {
  start();
  const auto stopped = lookingAt("/scene");
  stopped->readSlowly();
  const auto good = lookingAt("/scene");
  constexpr std::uint64_t kFrames = 150;
  // Each message has about 150 kB, more than all buffers between the two ends.
  for (std::uint64_t i = 1; i <= kFrames; ++i) {
    publish(i, 60);
    ASSERT_THAT(
        good->readMessage(1),
        HasSubstr("\"sec\":" + std::to_string((2'000'000'000 + 100'000'000 * i) / 1'000'000'000)))
        << i;
  }
  EXPECT_TRUE(eventually(5s, [&] { return metric("perdure_gateway_lost_total") > 10; }));
  const auto encoded = [&] { return metric("perdure_gateway_encoded_total"); };
  EXPECT_TRUE(eventually(5s, [&] { return encoded() >= static_cast<double>(kFrames); }));
  EXPECT_EQ(encoded(), static_cast<double>(kFrames));
}

TEST_F(Gateway, GoesOnThroughFramesThatLieOrMakeNoSense) {
  start();
  // The gateway closes these connections and counts the reasons, although the clients keep their
  // own side open.
  std::vector<std::unique_ptr<RawClient>> open;
  const auto isCut = [&](const std::function<void(RawClient&)>& say) {
    open.push_back(greeted());
    say(*open.back());
  };
  isCut([](RawClient& giant) {
    giant.send(std::string("\x82\xff\x7f\xff\xff\xff\xff\xff\xff\xff\0\0\0\0", 14));  // 8 exabytes
  });
  isCut([](RawClient& large) { large.sendFrame(std::string(100'000, ' ')); });
  // a frame without a mask
  isCut([](RawClient& bare) { bare.send(std::string("\x81\x02{}", 4)); });
  isCut([](RawClient& reserved) { reserved.sendFrame("x", 5); });
  isCut([](RawClient& latin) { latin.sendFrame("\xff\xfe"); });
  EXPECT_TRUE(eventually(20s, [&] {
    return refused("client_cut_message_too_large") == 2 &&
           refused("client_cut_protocol_violated") == 3;
  })) << get(port_, "/metrics").text;
  EXPECT_EQ(refused("client_cut_silent"), 0);
  for (const auto& client : open) EXPECT_TRUE(client->closed(10));
  const auto confused = greeted();
  for (const char* text : {"", "{", "[]", "{\"op\":\"subscribe\",\"subscriptions\":[[]]}"})
    confused->sendFrame(text);
  confused->sendFrame(std::string("\x02\x01\0\0\0", 5), 2);
  confused->sendFrame("", 2);
  for (int i = 0; i < 6; ++i) {
    const json status = json::parse(confused->readFrame().payload, nullptr, false);
    ASSERT_TRUE(status.is_object()) << i;
    EXPECT_EQ(status["op"], "status") << status;
  }
  confused->sendFrame(subscribe(9, channels_["/objects"]));
  EXPECT_TRUE(eventually(5s, [&] { return metric("perdure_gateway_clients") == 1; }))
      << get(port_, "/metrics").text;
  publish(++sequence_);
  EXPECT_THAT(confused->readMessage(9), HasSubstr("\"objects\""));
  serves();
}

TEST_F(Gateway, LetsSoManyClientsInAndNoMore) {
  start({"limits.clients=8", "limits.connections=40"});
  std::vector<std::unique_ptr<RawClient>> clients;
  int in = 0, told = 0;
  for (int i = 0; i < 100; ++i) {
    clients.push_back(std::make_unique<RawClient>(port_));
    const std::string head = clients.back()->upgrade();
    in += head.find(" 101 ") != std::string::npos;
    told += head.find(" 503 ") != std::string::npos;
  }
  EXPECT_EQ(in, 8);
  EXPECT_GT(told, 20);
  EXPECT_EQ(child_->wait(0ms), -1);
  clients.clear();
  ASSERT_TRUE(eventually(10s, [&] { return metric("perdure_gateway_clients") == 0; }));
  serves();
}

TEST_F(Gateway, LivesThroughAStormOfConnections) {
  start({"limits.connections=16"});
  const auto looks = lookingAt("/objects");
  for (int i = 0; i < 1000; ++i) {
    RawClient client(port_);
    if (i % 3 == 0) client.send("GET / HT");
    if (i % 3 == 1) client.send(std::string(1000, '\0'));
  }
  publish(++sequence_);
  EXPECT_THAT(looks->readMessage(1), HasSubstr("\"objects\""));
  EXPECT_TRUE(eventually(15s, [&] { return get(port_, "/healthz").status == 200; }));
}

TEST_F(Gateway, EndsRequestsThatTrickleInAndLongHeaders) {
  start();
  RawClient loris(port_);
  loris.send("GET / HTTP/1.1\r\nHost: localhost\r\nX-");
  RawClient lengthy(port_);
  lengthy.send("GET / HTTP/1.1\r\nHost: localhost\r\nX: " + std::string(20'000, 'x') + "\r\n\r\n");
  EXPECT_TRUE(lengthy.closed(10));
  EXPECT_TRUE(loris.closed(20));
  EXPECT_TRUE(eventually(
      5s, [&] { return refused("http_too_slow") >= 1 && refused("http_too_large") == 1; }));
  serves();
}

TEST_F(Gateway, EndsAtOnceWithClientsThatDoNotRead) {
  start();
  const auto client = lookingAt("/scene");
  client->readSlowly();
  for (std::uint64_t i = 1; i < 30; ++i) publish(i, 60);
  child_->signal(SIGTERM);
  EXPECT_EQ(child_->wait(5s), 0) << child_->log();
}

TEST_F(Gateway, SaysWhereItsPortIsTaken) {
  start();
  Child second({(programs() / "perdure-gateway").string(), "--port", std::to_string(port_)},
               folder_.file("second"));
  EXPECT_EQ(second.wait(20s), 69);
  EXPECT_THAT(second.log(), HasSubstr("set http.port to another one"));
}

}  // namespace
}  // namespace perdure::gateway::test
