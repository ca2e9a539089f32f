// Tests a recording with clients that control the playback, and the state shown at each time.
#include "tools/record/gateway_replay.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <map>
#include <nlohmann/json.hpp>
#include <thread>

#include "common/base/errors.h"
#include "common/replay/recordings/recording_writer.h"
#include "tests/process/support.h"
#include "tests/services/gateway/objects.h"
#include "tests/services/gateway/raw_client.h"

namespace perdure::tools {
namespace {

using gateway::test::eventOf;
using gateway::test::frameOf;
using gateway::test::graphFor;
using gateway::test::objectAt;
using gateway::test::RawClient;
using nlohmann::json;
using ::testing::HasSubstr;
constexpr std::uint64_t kSecond = 1'000'000'000;
constexpr char kNewest[] = "foxglove.sdk.v1";

class Replayed : public ::testing::Test {
 protected:
  Replayed() { record("run.mcap", 5000 * kSecond); }
  /// Twenty seconds at 10 Hz; log times differ from sensor times; events at 7 and 12 s. Objects
  /// come `late` frames after their image. The recording goes on for `rest_s`.
  void record(const std::string& name, std::uint64_t begin_ns, std::uint64_t late = 0,
              std::uint64_t rest_s = 0) {
    replay::RecordingWriter writer(folder_.file(name));
    Calibration calibration = gateway::test::forwardCamera();
    calibration.source = 42;
    mustBe(writer.add("calibration", calibration, begin_ns));
    for (std::uint64_t i = 0; i < 200; ++i) {
      const std::uint64_t log = begin_ns + i * kSecond / 10;
      mustBe(writer.add("frame/cam0", imageOf(i), log));
      mustBe(writer.add("landmarks", landmarksOf(i), log));
      const std::uint64_t of = i - std::min(i, late);
      mustBe(writer.add("objects",
                        frameOf(of, {objectAt(1, {0.1 * static_cast<double>(of), 0, 0})}), log));
      if (i == 70) mustBe(writer.add("events", eventOf(EventKind::kOccluded, 1), log));
      if (i == 120) mustBe(writer.add("events", eventOf(EventKind::kReappeared, 1), log));
      if (i == 20) mustBe(writer.add("map/reply", graphFor({}, frameOf(i, {}).world), log));
      if (i % 10 == 9) mustBe(writer.cut());
    }
    Health health;
    health.process = "capture";
    for (std::uint64_t s = 0; s < rest_s; ++s) {
      mustBe(writer.add("health", health, begin_ns + (20 + s) * kSecond));
      mustBe(writer.cut());
    }
    mustBe(writer.finish());
  }
  static Frame imageOf(std::uint64_t i) {
    Frame frame;
    frame.stamp = frameOf(i, {}).stamp;
    frame.camera = "cam0";
    frame.width = frame.height = 16;
    frame.data = std::make_shared<const std::vector<std::uint8_t>>(256, std::uint8_t{70});
    return frame;
  }
  static Landmarks landmarksOf(std::uint64_t i) {
    Landmarks landmarks;
    landmarks.stamp = frameOf(i, {}).stamp;
    landmarks.world = frameOf(i, {}).world;
    landmarks.camera = "cam0";
    landmarks.landmarks.resize(1);
    landmarks.landmarks[0].covariance.setIdentity();
    return landmarks;
  }
  template <class R>
  static void mustBe(const R& result) {
    if (!result) throw std::runtime_error(result.error().detail);
  }

  void startPaused() {
    gateway::PlaybackRequest how;
    how.play = false;
    start(how);
  }
  void start(const gateway::PlaybackRequest& how, const std::string& name = "run.mcap",
             double start_s = 0.0) {
    recording_ = std::make_unique<replay::RecordedMessages>(folder_.file(name));
    gateway::Config config;
    config.web.port = 0;
    config.cameras = {"cam0"};
    replay_ = std::make_unique<GatewayReplay>(*recording_, config, how, start_s);
    thread_ = std::thread([this] { replay_->run(); });
    client_ = std::make_unique<RawClient>(replay_->port());
    ASSERT_THAT(client_->upgrade("", kNewest), HasSubstr("101"));
    info_ = json::parse(client_->readFrame().payload);
    client_->sendFrame(R"({"op":"subscribe","subscriptions":[{"id":1,"channelId":8}]})");
  }
  ~Replayed() override {
    if (!replay_) return;
    replay_->stop();
    thread_.join();
  }

  /// Returns the sequence number of the next objects.
  std::uint64_t shown() {
    return json::parse(client_->readMessage(1), nullptr, false).value("sequence", 9999);
  }
  void control(bool play, float speed, std::optional<std::uint64_t> seek_ns = {}) {
    std::string bytes(19, '\0');
    bytes[0] = 3;
    bytes[1] = play ? 0 : 1;
    std::memcpy(&bytes[2], &speed, 4);
    bytes[6] = seek_ns ? 1 : 0;
    const std::uint64_t seek = seek_ns.value_or(0);
    std::memcpy(&bytes[7], &seek, 8);
    client_->sendFrame(bytes, 2);
  }
  /// Returns the next playback state: {status, time in s of the sensors}.
  std::pair<int, double> state() {
    while (true) {
      const auto frame = client_->readFrame();
      if (frame.opcode == 0xff) return {-1, 0};
      if (frame.opcode != 2 || frame.payload[0] != 5) continue;
      std::uint64_t time = 0;
      std::memcpy(&time, &frame.payload[2], 8);
      return {frame.payload[1], 1e-9 * static_cast<double>(time)};
    }
  }

  test::Folder folder_;
  std::unique_ptr<replay::RecordedMessages> recording_;
  std::unique_ptr<GatewayReplay> replay_;
  std::thread thread_;
  std::unique_ptr<RawClient> client_;
  json info_;
};

TEST_F(Replayed, SaysWhatItCoversInTheSensorsTime) {
  startPaused();
  EXPECT_THAT(info_["capabilities"], ::testing::Contains("playbackControl"));
  EXPECT_EQ(info_["dataStartTime"], (json{{"sec", 2}, {"nsec", 0}}));
  EXPECT_EQ(info_["dataEndTime"], (json{{"sec", 21}, {"nsec", 900'000'000}}));
}

TEST_F(Replayed, ShowsThePlaceThatIsSoughtWhilePaused) {
  startPaused();
  control(false, 1, 12 * kSecond);
  std::uint64_t sequence = 0;
  for (int i = 0; i < 5 && sequence != 100; ++i) sequence = shown();
  EXPECT_EQ(sequence, 100u);
  control(false, 1, 3 * kSecond);
  for (int i = 0; i < 5 && sequence != 10; ++i) sequence = shown();
  EXPECT_EQ(sequence, 10u);
}

TEST_F(Replayed, PlaysOnFromThereAndSaysWhenItHasEnded) {
  startPaused();
  control(true, 100, 20 * kSecond);
  std::pair<int, double> now;
  for (int i = 0; i < 5 && now.first != 3; ++i) now = state();
  EXPECT_EQ(now.first, 3);
  EXPECT_NEAR(now.second, 21.9, 0.05);
  control(true, 100);  // restarts from the beginning
  EXPECT_NEAR(state().second, 2.0, 0.2);
}

/// The times that a client receives after it subscribes to all topics.
class LateClient {
 public:
  explicit LateClient(std::uint16_t port) : client_(port) {
    (void)client_.upgrade("", kNewest);
    client_.sendFrame(R"({"op":"subscribe","subscriptions":[{"id":1,"channelId":1},
        {"id":2,"channelId":2},{"id":5,"channelId":5},{"id":8,"channelId":8},
        {"id":100,"channelId":100},{"id":101,"channelId":101},{"id":102,"channelId":102}]})");
  }
  /// Returns the times by subscription, when all have arrived. Key 0 is the time message, key -1
  /// the playback state.
  std::map<int, double> hear() {
    std::map<int, double> told;
    while (told.size() < 9) {
      const auto frame = client_.readFrame();
      if (frame.opcode == 0xff) break;
      if (frame.opcode != 2) continue;
      std::uint32_t subscription = 0;
      std::uint64_t time = 0;
      const std::uint8_t kind = static_cast<std::uint8_t>(frame.payload[0]);
      std::memcpy(&subscription, &frame.payload[1], 4);
      std::memcpy(&time, &frame.payload[kind == 1 ? 5 : kind == 2 ? 1 : 2], 8);
      const int who = kind == 1 ? static_cast<int>(subscription) : kind == 2 ? 0 : -1;
      told[who] = 1e-9 * static_cast<double>(time);
      if (kind == 5) status_ = frame.payload[1];
    }
    return told;
  }
  int status_ = -1;

 private:
  RawClient client_;
};

TEST_F(Replayed, TellsTheLastStateToWhoComesAfterTheEnd) {
  using ::testing::DoubleNear;
  using ::testing::Each;
  using ::testing::Pair;
  gateway::PlaybackRequest how;
  how.speed = 100;
  start(how, "run.mcap", 18.0);
  while (state().first != 3) {
  }
  client_.reset();  // in the loop, the first client and then the next one subscribe to images
  for (int i = 0; i < 2; ++i) {
    LateClient late(replay_->port());
    const auto told = late.hear();
    EXPECT_EQ(told.size(), 9u);
    EXPECT_THAT(told, Each(Pair(::testing::_, DoubleNear(21.9, 1e-6))));
    EXPECT_EQ(late.status_, 3);
    LateClient beside(replay_->port());
    EXPECT_EQ(beside.hear(), told);
  }
}

TEST_F(Replayed, ShowsTheImageOfAPlaceThatIsSoughtWhilePaused) {
  startPaused();
  client_->sendFrame(R"({"op":"subscribe","subscriptions":[{"id":5,"channelId":100}]})");
  EXPECT_FALSE(client_->readMessage(5).empty());
  control(false, 1, 21'900'000'000);
  EXPECT_FALSE(client_->readMessage(5).empty());
}

TEST_F(Replayed, ShowsTheImageOfTheShownObjectsWhilePaused) {
  record("late.mcap", 100 * kSecond, 2);
  gateway::PlaybackRequest how;
  how.play = false;
  start(how, "late.mcap");
  client_->sendFrame(R"({"op":"subscribe","subscriptions":[{"id":5,"channelId":100}]})");
  control(false, 1, 12 * kSecond);
  std::map<std::uint32_t, std::uint64_t> newest;  // times by subscription
  const auto fits = [&] { return newest[1] > 11 * kSecond && newest[1] == newest[5]; };
  while (!fits()) {
    const auto frame = client_->readFrame();
    ASSERT_NE(frame.opcode, 0xff) << "objects of " << newest[1] << ", image of " << newest[5];
    if (frame.opcode != 2 || frame.payload[0] != 1) continue;
    std::uint32_t subscription = 0;
    std::memcpy(&subscription, &frame.payload[1], 4);
    std::memcpy(&newest[subscription], &frame.payload[5], 8);
  }
}

TEST_F(Replayed, HasTheLengthOfTheDriveIfTheRecordingGoesOn) {
  record("rest.mcap", 100 * kSecond, 0, 60);
  start({}, "rest.mcap");
  EXPECT_EQ(info_["dataEndTime"], (json{{"sec", 21}, {"nsec", 900'000'000}}));
}

TEST_F(Replayed, TellsNoPlaybackInTheOlderSubprotocol) {
  startPaused();
  RawClient older(replay_->port());
  ASSERT_THAT(older.upgrade("", "foxglove.websocket.v1"), HasSubstr("101"));
  EXPECT_THAT(json::parse(older.readFrame().payload)["capabilities"],
              ::testing::Not(::testing::Contains("playbackControl")));
  older.sendFrame(R"({"op":"subscribe","subscriptions":[{"id":1,"channelId":8}]})");
  control(false, 1, 12 * kSecond);
  for (std::uint64_t sequence = 0; sequence != 100;) {
    const auto frame = older.readFrame();
    ASSERT_NE(frame.opcode, 0xff);
    if (frame.opcode != 2) continue;
    ASSERT_NE(frame.payload[0], 5) << "the state of the playback";
    if (frame.payload[0] == 1) sequence = json::parse(frame.payload.substr(13))["sequence"];
  }
}

TEST_F(Replayed, EndsWhereItIsPlayedOnFromTheLastFrame) {
  startPaused();
  control(false, 1, 21'900'000'000);
  while (state().second < 21.8) {
  }
  control(true, 1);
  std::pair<int, double> now;
  for (int i = 0; i < 5 && now.first != 3; ++i) now = state();
  EXPECT_EQ(now.first, 3);
}

TEST_F(Replayed, BeginsWhereItIsToldToWithTheCameraOfBefore) {
  gateway::PlaybackRequest how;
  how.play = false;
  start(how, "run.mcap", 13.0);
  EXPECT_EQ(shown(), 130u);
  client_->sendFrame(R"({"op":"subscribe","subscriptions":[{"id":5,"channelId":101}]})");
  EXPECT_EQ(json::parse(client_->readMessage(5), nullptr, false).value("width", 0), 640);
}

TEST_F(Replayed, TakesARecordingWhoseClockBeganAtZero) {
  record("zero.mcap", 0);
  gateway::PlaybackRequest how;
  how.play = false;
  start(how, "zero.mcap");
  EXPECT_EQ(info_["dataStartTime"], (json{{"sec", 2}, {"nsec", 0}}));
}

TEST_F(Replayed, HasTheGraphThatWasToldLastBeforeThePlace) {
  startPaused();
  client_->sendFrame(R"({"op":"subscribe","subscriptions":[{"id":2,"channelId":15}]})");
  control(false, 1, 18 * kSecond);
  json graph = json::object();
  for (int i = 0; i < 10 && graph.value("anchors", json::array()).empty(); ++i) {
    graph = json::parse(client_->readMessage(2), nullptr, false);
  }
  EXPECT_EQ(graph["anchors"].size(), 3u);
  EXPECT_EQ(graph["loops"].size(), 4u);
  client_->sendFrame(R"({"op":"unsubscribe","subscriptionIds":[2]})");
  client_->sendFrame(R"({"op":"subscribe","subscriptions":[{"id":3,"channelId":16}]})");
  const json scene = json::parse(client_->readMessage(3), nullptr, false);
  EXPECT_EQ(scene["entities"].size(), 8u) << "who looks again sees it again";
}

TEST_F(Replayed, GoesOnToTheNextEvent) {
  startPaused();
  const std::string call("\x02\x03\0\0\0\x09\0\0\0\x04\0\0\0json{}", 19);
  std::vector<double> places;
  for (int i = 0; i < 2; ++i) {
    client_->sendFrame(call, 2);
    std::pair<int, double> now;
    do now = state();
    while (now.first >= 0 && now.second <= (places.empty() ? 2.05 : places.back()));
    places.push_back(now.second);
  }
  EXPECT_THAT(places, ::testing::Pointwise(::testing::DoubleNear(0.11), {9.0, 14.0}));
  client_->sendFrame(call, 2);
  while (true) {
    const auto frame = client_->readFrame();
    ASSERT_NE(frame.opcode, 0xff);
    if (frame.payload.find("there is no later event") != std::string::npos) break;
  }
}

TEST_F(Replayed, AnswersAboutAnObjectAndSaysThatThereIsNoStore) {
  startPaused();
  (void)shown();
  std::string call("\x02\x01\0\0\0\x09\0\0\0\x04\0\0\0json{\"id\":1}", 25);
  client_->sendFrame(call, 2);
  std::string answer;
  while (answer.find("\"found\":true") == std::string::npos) {
    const auto frame = client_->readFrame();
    ASSERT_NE(frame.opcode, 0xff);
    answer = frame.payload;
  }
  call[1] = 2;
  client_->sendFrame(call, 2);
  while (answer.find("has no map store") == std::string::npos) {
    const auto frame = client_->readFrame();
    ASSERT_NE(frame.opcode, 0xff);
    answer = frame.payload;
  }
}

TEST_F(Replayed, RefusesToBeginAfterTheEnd) {
  replay::RecordedMessages recording(folder_.file("run.mcap"));
  gateway::Config config;
  config.web.port = 0;
  EXPECT_THROW(GatewayReplay(recording, config, {}, 20.5), StartupError);
}

TEST(Replay, RefusesARecordingWithNothingToShow) {
  const test::Folder folder;
  replay::RecordingWriter writer(folder.file("run.mcap"));
  SpeedSample speed;
  speed.source = 1;
  ASSERT_TRUE(writer.add("speed", speed, 1));
  ASSERT_TRUE(writer.finish());
  replay::RecordedMessages recording(folder.file("run.mcap"));
  EXPECT_THROW(GatewayReplay(recording, {}, {}), StartupError);
}

}  // namespace
}  // namespace perdure::tools
