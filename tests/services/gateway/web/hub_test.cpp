// Tests subscriptions and queues without sockets.
#include "services/gateway/web/hub.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "services/gateway/web/files.h"
#include "services/gateway/web/guard.h"

namespace perdure::gateway::web {
namespace {

using nlohmann::json;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using Clock = std::chrono::steady_clock;

class TestViewer : public Viewer {
 public:
  using Viewer::Viewer;
  void flush() override {}
  void cut(const std::string& why) override { cut_ = why; }
  /// Takes all queued messages, as if they were sent.
  std::vector<std::string> read() {
    std::vector<std::string> all;
    while (const auto one = outbox().take()) all.push_back(*one->payload);
    return all;
  }
  std::string cut_;
};

Encoded message(std::uint32_t channel, const std::string& payload) {
  return {channel, fromNanoseconds(1), std::make_shared<const std::string>(payload)};
}

std::string subscribe(std::uint32_t id, std::uint32_t channel) {
  return json{{"op", "subscribe"}, {"subscriptions", {{{"id", id}, {"channelId", channel}}}}}
      .dump();
}

class HubTest : public ::testing::Test {
 protected:
  HubTest() {
    hub_.offer({{1, "/newest", "json", "A", "jsonschema", "{}", Delivery::kNewest},
                {2, "/each", "json", "A", "jsonschema", "{}", Delivery::kEach},
                {3, "/newest too", "json", "A", "jsonschema", "{}", Delivery::kNewest}},
               {{1, "/ask", "Ask", "{}", "{}"}});
  }
  void join(TestViewer& viewer) {
    hub_.join(viewer);
    (void)viewer.read();
  }
  void say(TestViewer& viewer, const std::string& text) { hub_.hear(viewer, text, true, now_); }

  Clock::time_point now_{};
  std::vector<Channels> wanted_;
  std::vector<Call> calls_;
  Hub hub_{"perdure",
           "s",
           4,
           {.wanted = [this](const Channels& c) { wanted_.push_back(c); },
            .call = [this](Call c) { calls_.push_back(std::move(c)); }}};
};

TEST_F(HubTest, GreetsWithServerInfoChannelsAndServices) {
  TestViewer viewer(4);
  hub_.join(viewer);
  const auto said = viewer.read();
  ASSERT_EQ(said.size(), 3u);
  EXPECT_EQ(json::parse(said[0])["op"], "serverInfo");
  EXPECT_EQ(json::parse(said[1])["channels"].size(), 3u);
  EXPECT_EQ(json::parse(said[2])["services"][0]["name"], "/ask");
}

TEST_F(HubTest, TellsWhatIsLookedAtOnceForAllWhoLook) {
  TestViewer a(4), b(4);
  join(a), join(b);
  say(a, subscribe(1, 1));
  say(b, subscribe(1, 1));
  say(a, R"({"op":"unsubscribe","subscriptionIds":[1]})");
  hub_.leave(b);
  EXPECT_THAT(wanted_, ElementsAre(Channels{1}, Channels{}));
}

TEST_F(HubTest, GivesASlowClientTheNewestAndOthersEverything) {
  TestViewer slow(4), fast(4);
  join(slow), join(fast);
  say(slow, subscribe(7, 1));
  say(fast, subscribe(7, 1));
  std::vector<std::string> heard;
  for (int i = 0; i < 50; ++i) {
    hub_.publish(message(1, std::to_string(i)));
    for (const auto& one : fast.read()) heard.push_back(one);
  }
  EXPECT_EQ(heard.size(), 50u);
  EXPECT_THAT(slow.read(), ElementsAre("49"));
  EXPECT_EQ(hub_.dropped(), 49u);
}

TEST_F(HubTest, GivesTheWholeToWhoMissedChanges) {
  TestViewer slow(4), late(4);
  join(slow), join(late);
  say(slow, subscribe(7, 1));
  const auto publish = [&](const std::string& step) {
    Encoded changes = message(1, "change " + step);
    changes.whole = std::make_shared<const std::string>("whole " + step);
    hub_.publish(changes);
  };
  publish("0");
  EXPECT_THAT(slow.read(), ElementsAre("change 0"));
  publish("1"), publish("2");
  EXPECT_THAT(slow.read(), ElementsAre("whole 2"));
  say(late, subscribe(7, 1));
  EXPECT_THAT(late.read(), ElementsAre("whole 2"));
}

TEST_F(HubTest, KeepsABoundedQueueOfEventsAndTellsTheLoss) {
  TestViewer viewer(4);
  join(viewer);
  say(viewer, subscribe(7, 2));
  for (int i = 0; i < 10; ++i) hub_.publish(message(2, std::to_string(i)));
  EXPECT_EQ(viewer.outbox().takeLostEvents(), 6u);
  EXPECT_THAT(viewer.read(), ElementsAre("6", "7", "8", "9"));
}

TEST_F(HubTest, GivesWhoComesLateTheNewestAndTheLastEventsAndTheTime) {
  TestViewer first(4), late(4);
  join(first), join(late);
  say(first, subscribe(1, 2));
  say(first, subscribe(2, 3));
  say(first, subscribe(3, 1));
  for (int i = 0; i < 9; ++i) {
    for (const std::uint32_t channel : {1U, 2U, 3U})
      hub_.publish(message(channel, std::to_string(i)));
    hub_.tellTime(fromNanoseconds(i));
  }
  say(late, subscribe(1, 2));
  say(late, subscribe(2, 3));
  say(late, subscribe(3, 1));
  EXPECT_THAT(late.read(),
              ElementsAre(protocol::time(fromNanoseconds(8)), "5", "6", "7", "8", "8", "8"));
}

TEST_F(HubTest, TellsNoTimeOfBeforeAnybodyLooked) {
  TestViewer viewer(4);
  join(viewer);
  say(viewer, subscribe(1, 3));
  hub_.tellTime(fromNanoseconds(5));
  say(viewer, R"({"op":"unsubscribe","subscriptionIds":[1]})");
  hub_.tellTime(fromNanoseconds(6));
  (void)viewer.read();
  say(viewer, subscribe(2, 3));
  EXPECT_THAT(viewer.read(), ElementsAre());
}

TEST_F(HubTest, ForgetsWhatNobodyLooksAtAnyMore) {
  TestViewer viewer(4);
  join(viewer);
  say(viewer, subscribe(1, 3));
  hub_.publish(message(3, "old"));
  say(viewer, R"({"op":"unsubscribe","subscriptionIds":[1]})");
  hub_.publish(message(3, "unheard"));
  say(viewer, subscribe(2, 3));
  EXPECT_THAT(viewer.read(), ElementsAre());
}

TEST_F(HubTest, AnswersNonsenseWithAStatusAndGoesOn) {
  TestViewer viewer(4);
  join(viewer);
  for (const char* text :
       {"{", R"({"op":"subscribe","subscriptions":[{"id":1,"channelId":99}]})",
        R"({"op":"unsubscribe","subscriptionIds":[5]})", R"({"op":"advertise"})"}) {
    say(viewer, text);
    const auto said = viewer.read();
    ASSERT_EQ(said.size(), 1u) << text;
    EXPECT_EQ(json::parse(said[0])["op"], "status") << text;
  }
  say(viewer, subscribe(1, 1));
  say(viewer, subscribe(1, 1));
  EXPECT_EQ(json::parse(viewer.read().at(0))["level"], 2);
  EXPECT_TRUE(viewer.cut_.empty());
  EXPECT_EQ(hub_.reasons().of("client_said_json_malformed"), 1u);
}

TEST_F(HubTest, CutsAClientThatAsksAndNeverReads) {
  TestViewer viewer(4);
  join(viewer);
  for (int i = 0; i < 1000 && viewer.cut_.empty(); ++i) {
    now_ += std::chrono::milliseconds(20);
    say(viewer, "{");
  }
  EXPECT_THAT(viewer.cut_, HasSubstr("does not read"));
  EXPECT_LE(viewer.outbox().size(), 256u);
}

TEST_F(HubTest, CutsAClientThatSaysTooMuch) {
  TestViewer viewer(4);
  join(viewer);
  for (int i = 0; i < 201; ++i) {
    say(viewer, R"({"op":"subscribeConnectionGraph"})");
  }
  EXPECT_THAT(viewer.cut_, HasSubstr("messages a second"));
}

TEST_F(HubTest, PassesCallsOnAndAnswersWhoStillIsThere) {
  TestViewer viewer(4);
  join(viewer);
  std::string call{2, 1, 0, 0, 0, 9, 0, 0, 0, 4, 0, 0, 0};
  call += "json{\"id\":3}";
  hub_.hear(viewer, call, false, now_);
  ASSERT_EQ(calls_.size(), 1u);
  EXPECT_EQ(calls_[0].payload, "{\"id\":3}");
  hub_.answer({calls_[0].client, 1, 9, true, "{}"});
  hub_.answer({calls_[0].client, 1, 9, false, "there is none"});
  const auto said = viewer.read();
  ASSERT_EQ(said.size(), 2u);
  EXPECT_EQ(said[0][0], 3);
  EXPECT_EQ(json::parse(said[1])["message"], "there is none");
  hub_.leave(viewer);
  hub_.answer({calls_[0].client, 1, 9, true, "{}"});
  EXPECT_THAT(viewer.read(), ElementsAre());
  call[1] = 77;  // a service with this number does not exist
  TestViewer other(4);
  join(other);
  hub_.hear(other, call, false, now_);
  EXPECT_EQ(json::parse(other.read().at(0))["op"], "serviceCallFailure");
}

Options with(const std::string& token, std::vector<std::string> hosts = {}) {
  Options options;
  options.token = token;
  options.allowed_hosts = std::move(hosts);
  return options;
}

TEST(Guard, TakesLoopbackNamesAloneWhereThereIsNoToken) {
  const Guard guard(with("", {"robot.local"}));
  for (const char* host : {"127.0.0.1:8765", "localhost:9000", "LOCALHOST", "[::1]:8765",
                           "127.1.2.3", "robot.local:8765"}) {
    EXPECT_TRUE(guard.checkHost(host)) << host;
  }
  for (const char* host : {"", "evil.example", "127.0.0.1.evil.example", "127.0.0.1evil",
                           "localhost.evil", "10.0.0.1", "[::2]", "[", "127.0.0.256", "127.0.0"}) {
    EXPECT_FALSE(guard.checkHost(host)) << host;
  }
}

TEST(Guard, TakesItsOwnPageAndThoseThatAreListed) {
  const Guard guard{Options{}};
  EXPECT_TRUE(guard.checkOrigin("", "127.0.0.1:8765"));
  EXPECT_TRUE(guard.checkOrigin("http://127.0.0.1:8765", "127.0.0.1:8765"));
  EXPECT_TRUE(guard.checkOrigin("https://app.foxglove.dev", "127.0.0.1:8765"));
  for (const char* origin :
       {"https://evil.example", "null", "http://127.0.0.1:1", "file://127.0.0.1:8765",
        "https://app.foxglove.dev.evil.example", "http://"}) {
    EXPECT_FALSE(guard.checkOrigin(origin, "127.0.0.1:8765")) << origin;
  }
  EXPECT_FALSE(guard.checkOrigin("http://", ""));
}

TEST(Guard, WantsTheTokenWhereOneIsSet) {
  const Guard guard(with("s3cret"));
  EXPECT_TRUE(guard.checkToken("/?a=b&token=s3cret", ""));
  EXPECT_TRUE(guard.checkToken("/", "Bearer s3cret"));
  for (const char* target : {"/", "/?token=", "/?token=s3cre", "/?token=s3crets",
                             "/?token=s3cretS3cret", "/?xtoken=s3cret", "/token=s3cret"}) {
    EXPECT_FALSE(guard.checkToken(target, "")) << target;
  }
  EXPECT_TRUE(guard.checkHost("vehicle.example"));
  EXPECT_TRUE(Guard{Options{}}.checkToken("/", ""));
}

TEST(Files, AreThoseOfTheFolderAndNoOthers) {
  const auto folder =
      std::filesystem::temp_directory_path() / ("perdure-files-" + std::to_string(getpid()));
  std::filesystem::create_directories(folder / "vendor");
  std::ofstream(folder / "index.html") << "page";
  std::ofstream(folder / "vendor" / "a.js") << "code";
  std::ofstream(folder / "vendor" / "a.js.gz") << "packed";
  const Files files(folder);
  ASSERT_NE(files.find("/"), nullptr);
  EXPECT_EQ(files.find("/")->content, "page");
  EXPECT_EQ(files.find("/vendor/a.js")->packed, "packed");
  EXPECT_THAT(files.find("/vendor/a.js")->type, HasSubstr("javascript"));
  for (const char* path : {"/../etc/passwd", "/vendor/../index.html", "", "//index.html", "/vendor",
                           "/vendor/a.js.gz", "index.html"}) {
    EXPECT_EQ(files.find(path), nullptr) << path;
  }
  std::filesystem::remove_all(folder);
  EXPECT_TRUE(Files(folder).empty());
}

}  // namespace
}  // namespace perdure::gateway::web
