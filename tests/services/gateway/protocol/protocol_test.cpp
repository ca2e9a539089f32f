#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "services/gateway/core/channels.h"
#include "services/gateway/protocol/client_message.h"
#include "services/gateway/protocol/server_message.h"

namespace perdure::gateway::protocol {
namespace {

using nlohmann::json;

std::string reasonOf(const std::string& text) {
  const auto message = parseText(text);
  return message ? "" : message.error().code;
}

TEST(ClientMessage, IsReadAsTheProtocolSays) {
  const auto subscribe = parseText(
      R"({"op":"subscribe","subscriptions":[{"id":0,"channelId":3},{"id":4294967295,"channelId":5}]})");
  ASSERT_TRUE(subscribe);
  const auto& list = std::get<Subscribe>(*subscribe).subscriptions;
  ASSERT_EQ(list.size(), 2u);
  EXPECT_EQ(list[1].id, 4294967295U);
  EXPECT_EQ(list[1].channel, 5u);
  EXPECT_EQ(std::get<Unsubscribe>(*parseText(R"({"op":"unsubscribe","subscriptionIds":[7]})")).ids,
            std::vector<std::uint32_t>{7});
  EXPECT_EQ(std::get<NotOffered>(*parseText(R"({"op":"advertise","channels":[]})")).what,
            "advertise");
  EXPECT_TRUE(std::holds_alternative<Ignored>(*parseText(R"({"op":"subscribeConnectionGraph"})")));
  EXPECT_EQ(
      std::get<GetParameters>(*parseText(R"({"op":"getParameters","parameterNames":[],"id":"q"})"))
          .id,
      "q");
}

TEST(ClientMessage, IsRefusedWithAReasonWhereItIsNot) {
  EXPECT_EQ(reasonOf(""), "json_malformed");
  EXPECT_EQ(reasonOf("{"), "json_malformed");
  EXPECT_EQ(reasonOf("[1]"), "op_missing");
  EXPECT_EQ(reasonOf(R"({"op":7})"), "op_missing");
  EXPECT_EQ(reasonOf(R"({"op":"dance"})"), "op_unknown");
  EXPECT_EQ(reasonOf(R"({"op":"subscribe"})"), "member_malformed");
  EXPECT_EQ(reasonOf(R"({"op":"subscribe","subscriptions":{}})"), "member_malformed");
  for (const char* id :
       {"-1", "1.5", "4294967296", "\"1\"", "null", "1e3", "18446744073709551616"}) {
    EXPECT_EQ(reasonOf(std::string(R"({"op":"subscribe","subscriptions":[{"id":)") + id +
                       R"(,"channelId":1}]})"),
              "member_malformed")
        << id;
  }
  EXPECT_EQ(reasonOf(R"({"op":"subscribe","subscriptions":[3]})"), "member_malformed");
  json many = {{"op", "unsubscribe"},
               {"subscriptionIds", std::vector<int>(kMostSubscriptions + 1, 1)}};
  EXPECT_EQ(reasonOf(many.dump()), "too_many_subscriptions");
  EXPECT_EQ(reasonOf(std::string(200000, '[')), "json_malformed");
}

TEST(ClientMessage, CallsAServiceInBinary) {
  std::vector<std::uint8_t> bytes{2, 1, 0, 0,   0,   9,   0,   0,   0,  4,
                                  0, 0, 0, 'j', 's', 'o', 'n', '{', '}'};
  const auto call = parseBinary(bytes);
  ASSERT_TRUE(call);
  EXPECT_EQ(std::get<ServiceCall>(*call).call, 9u);
  EXPECT_EQ(std::get<ServiceCall>(*call).payload, "{}");
  for (std::size_t length = 1; length < 17; ++length) {
    const auto cut = parseBinary(std::span(bytes).first(length));
    ASSERT_FALSE(cut) << length;
    EXPECT_EQ(cut.error().code, "binary_short");
  }
  bytes[12] = 0xff;  // an encoding name of 4 GB
  EXPECT_EQ(parseBinary(bytes).error().code, "binary_short");
  EXPECT_EQ(parseBinary({}).error().code, "binary_empty");
  const std::vector<std::uint8_t> unknown{200};
  EXPECT_EQ(parseBinary(unknown).error().code, "binary_unknown");
}

TEST(ClientMessage, ControlsAPlaybackWithinReason) {
  std::vector<std::uint8_t> bytes{3, 0, 0, 0, 0xc0, 0x3f, 1, 5, 0,   0,  0,
                                  0, 0, 0, 0, 2,    0,    0, 0, 'i', 'd'};
  const auto request = parseBinary(bytes);
  ASSERT_TRUE(request);
  const auto& playback = std::get<PlaybackRequest>(*request);
  EXPECT_TRUE(playback.play);
  EXPECT_DOUBLE_EQ(playback.speed, 1.5);
  EXPECT_EQ(playback.seek, fromNanoseconds(5));
  EXPECT_EQ(playback.id, "id");
  for (std::size_t length = 1; length < bytes.size(); ++length) {
    EXPECT_EQ(parseBinary(std::span(bytes).first(length)).error().code, "binary_short") << length;
  }
  auto wrong = bytes;
  wrong[1] = 2;
  EXPECT_EQ(parseBinary(wrong).error().code, "playback_malformed");
  wrong = bytes;
  wrong[4] = 0xc0, wrong[5] = 0x7f;  // not a number
  EXPECT_EQ(parseBinary(wrong).error().code, "playback_malformed");
  wrong = bytes;
  wrong[14] = 0xff;  // beyond the range of time
  EXPECT_EQ(parseBinary(wrong).error().code, "playback_malformed");
}

TEST(ServerMessage, TellsOfAPlayback) {
  EXPECT_EQ(playbackState({.status = PlaybackState::Status::kPaused,
                           .time = fromNanoseconds(5),
                           .speed = 1.5,
                           .did_seek = true,
                           .id = "id"}),
            std::string("\x05\x01\x05\0\0\0\0\0\0\0\0\0\xc0\x3f\x01\x02\0\0\0id", 21));
  const json info = json::parse(
      serverInfo("x", "s", TimeRange{fromNanoseconds(2'000'000'001), fromNanoseconds(3)}));
  EXPECT_EQ(info["dataStartTime"]["nsec"], 1);
  EXPECT_THAT(info["capabilities"], ::testing::Contains("playbackControl"));
  EXPECT_FALSE(json::parse(serverInfo("x", "s")).contains("dataStartTime"));
}

TEST(ServerMessage, ChoosesTheNewestSubprotocolThatIsOffered) {
  EXPECT_EQ(chooseSubprotocol("foxglove.websocket.v1"), "foxglove.websocket.v1");
  EXPECT_EQ(chooseSubprotocol("foxglove.websocket.v1 ,\tfoxglove.sdk.v1"), "foxglove.sdk.v1");
  EXPECT_EQ(chooseSubprotocol("foxglove.sdk.v11,, chat"), "");
  EXPECT_EQ(chooseSubprotocol(""), "");
}

TEST(ServerMessage, AdvertisesEachChannelWithASchemaThatIsOne) {
  const json message = json::parse(advertise(channelTable({"cam0", "left"})));
  std::set<int> ids;
  std::set<std::string> topics;
  for (const auto& channel : message["channels"]) {
    ids.insert(channel["id"].get<int>());
    topics.insert(channel["topic"]);
    if (channel["schemaEncoding"] != "jsonschema") continue;
    const json schema = json::parse(channel["schema"].get<std::string>());
    EXPECT_EQ(schema["title"], channel["schemaName"]);
    EXPECT_EQ(schema["type"], "object");
  }
  EXPECT_EQ(ids.size(), message["channels"].size());
  EXPECT_EQ(topics.size(), message["channels"].size());
  EXPECT_TRUE(topics.contains("/camera/left/annotations"));
}

TEST(ServerMessage, PutsNumbersLittleEndian) {
  const MessageHead head = messageHead(0x01020304, fromNanoseconds(0x0a0b));
  EXPECT_THAT(head, ::testing::ElementsAre(1, 4, 3, 2, 1, 0x0b, 0x0a, 0, 0, 0, 0, 0, 0));
  EXPECT_EQ(time(fromNanoseconds(-5)), std::string("\x02\0\0\0\0\0\0\0\0", 9));
  EXPECT_EQ(serviceResponse(1, 2, "{}"),
            std::string("\x03\x01\0\0\0\x02\0\0\0\x04\0\0\0json{}", 19));
}

}  // namespace
}  // namespace perdure::gateway::protocol
