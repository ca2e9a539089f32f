// The bus within one process: counts, disposal, and the end of the loop.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <thread>

#include "common/base/errors.h"
#include "common/bus/dds.h"
#include "common/bus/discovery.h"
#include "common/bus/wait_loop.h"
#include "tests/common/bus/isolation.h"
#include "tests/common/bus/run_until.h"

namespace perdure::bus {
namespace {

using testing::Contains;
using testing::ElementsAre;

class Isolation : public testing::Environment {
 public:
  void SetUp() override { tests::isolateNetwork(); }
};
const auto* const kIsolation = testing::AddGlobalTestEnvironment(new Isolation);

constexpr std::chrono::milliseconds kStep{20};

ReasonCounts reportOf(const auto& endpoint) {
  ReasonCounts counts;
  endpoint.report(counts);
  return counts;
}

class Bus : public testing::Test {
 protected:
  Domain domain{Options{}};
  Participant here{domain, "here"}, there{domain, "there"};
  WaitLoop loop{here};
};

TEST_F(Bus, CarriesAMessageFromWriterToReader) {
  Reader<ImuSample> reader(here, kTopic<ImuSample>);
  std::vector<std::uint64_t> got;
  loop.on(reader, [&](const ImuSample& m) { got.push_back(m.sequence); });
  Writer<ImuSample> writer(there, kTopic<ImuSample>);
  ImuSample sample;
  sample.sequence = 7;
  EXPECT_TRUE(writer.write(sample));
  EXPECT_TRUE(runUntil(loop, [&] { return !got.empty(); }));
  EXPECT_THAT(got, ElementsAre(7));
  EXPECT_EQ(reader.matched(), 1u);
  EXPECT_EQ(writer.matched(), 1u);
}

TEST_F(Bus, RefusesToSendWhatIsNotSoundAndCountsIt) {
  Writer<ImuSample> writer(there, kTopic<ImuSample>);
  ImuSample sample;
  sample.gyro.x() = NAN;
  const Result<void> written = writer.write(sample);
  ASSERT_FALSE(written);
  EXPECT_EQ(written.error().code, "not_finite");
  EXPECT_EQ(reportOf(writer).of("imu_refused_not_finite"), 1u);
}

/// A writer of another program: Cyclone's C API and the generated type, without checks.
class RawDetections {
 public:
  explicit RawDetections(const Participant& participant)
      : topic_(dds_create_topic(participant.handle(), &perdure_msg_Detections_desc,
                                participant.wireName("detections").c_str(), nullptr, nullptr)) {
    const QosPtr qos(dds_create_qos());
    dds_qset_reliability(qos.get(), DDS_RELIABILITY_RELIABLE, DDS_SECS(1));
    dds_qset_ownership(qos.get(), DDS_OWNERSHIP_EXCLUSIVE);
    dds_qset_ownership_strength(qos.get(), 5);
    dds_qset_liveliness(qos.get(), DDS_LIVELINESS_MANUAL_BY_TOPIC, DDS_MSECS(300));
    writer_ = Entity(dds_create_writer(participant.handle(), topic_.handle(), qos.get(), nullptr));
  }
  void write(double x2, const char* camera) {
    perdure_msg_Detection item{};
    item.corners[2] = x2;
    item.corners[3] = 1;
    perdure_msg_Detections message{};
    message.camera = const_cast<char*>(camera);
    message.items = {1, 1, &item, false};
    ASSERT_EQ(dds_write(writer_.handle(), &message), DDS_RETCODE_OK);
  }
  void writeMany(std::size_t boxes) {
    perdure_msg_Detection item{};
    item.corners[2] = item.corners[3] = 1;
    std::vector<perdure_msg_Detection> items(boxes, item);
    perdure_msg_Detections message{};
    char camera[] = "cam0";
    message.camera = camera;
    const auto n = static_cast<std::uint32_t>(boxes);
    message.items = {n, n, items.data(), false};
    ASSERT_EQ(dds_write(writer_.handle(), &message), DDS_RETCODE_OK);
  }

 private:
  Entity topic_, writer_;
};

TEST_F(Bus, TooManyBoxesAreCountedAndWhatFollowsIsHeard) {
  Reader<Detections> reader(here, kTopic<Detections>);
  int sound = 0;
  loop.on(reader, [&](const Detections&) { ++sound; });
  RawDetections stranger(there);
  ASSERT_TRUE(runUntil(loop, [&] { return reader.matched() == 1; }));
  stranger.writeMany(50'000);
  EXPECT_TRUE(
      runUntil(loop, [&] { return reportOf(reader).of("detections_malformed_over_bound") == 1; }));
  stranger.write(1.0, "cam0");
  EXPECT_TRUE(runUntil(loop, [&] { return sound == 1; }));
}

TEST_F(Bus, CountsMalformedDetectionsOfAStrangerAndHearsItsSoundOnes) {
  Reader<Detections> reader(here, kTopic<Detections>);
  int sound = 0;
  loop.on(reader, [&](const Detections&) { ++sound; });
  RawDetections stranger(there);
  stranger.write(NAN, "cam0");
  stranger.write(-1.0, "cam0");
  stranger.write(1.0, "\xff\xfe");
  stranger.write(1.0, "cam0");
  EXPECT_TRUE(runUntil(loop, [&] { return sound == 1; }));
  const ReasonCounts counts = reportOf(reader);
  EXPECT_EQ(counts.of("detections_malformed_not_finite"), 1u);
  EXPECT_EQ(counts.of("detections_malformed_out_of_range"), 1u);
  EXPECT_EQ(counts.of("detections_malformed_bad_text"), 1u);
}

TEST_F(Bus, CountsAWriterWhoseQualityOfServiceDoesNotFit) {
  Reader<Detections> reader(here, kTopic<Detections>);
  const Entity topic(dds_create_topic(there.handle(), &perdure_msg_Detections_desc,
                                      there.wireName("detections").c_str(), nullptr, nullptr));
  const Entity shared(dds_create_writer(there.handle(), topic.handle(), nullptr, nullptr));
  EXPECT_TRUE(
      runUntil(loop, [&] { return reportOf(reader).of("detections_incompatible_qos") == 1; }));
  EXPECT_EQ(reader.matched(), 0u);
}

TEST_F(Bus, TellsTheKeyOfADisposedObjectAfterItsLastState) {
  Reader<MapTile> reader(here, kTopic<MapTile>);
  std::vector<std::string> story;
  loop.on(
      reader, [&](const MapTile& m) { story.push_back("tile " + std::to_string(m.x)); },
      [&](const MapTile& m) { story.push_back("gone " + std::to_string(m.x)); });
  Writer<MapTile> writer(there, kTopic<MapTile>);
  MapTile tile;
  tile.x = 3;
  EXPECT_TRUE(writer.write(tile));
  EXPECT_TRUE(writer.dispose(tile));
  EXPECT_TRUE(runUntil(loop, [&] { return story.size() == 2; }));
  EXPECT_THAT(story, ElementsAre("tile 3", "gone 3"));
}

TEST_F(Bus, ADeadWriterDoesNotDisposeWhatItWrote) {
  Reader<MapTile> reader(here, kTopic<MapTile>);
  int tiles = 0, gone = 0, silent = 0;
  loop.on(
      reader, [&](const MapTile&) { ++tiles; }, [&](const MapTile&) { ++gone; });
  {
    Writer<MapTile> writer(there, kTopic<MapTile>);
    EXPECT_TRUE(writer.write(MapTile{}));
    EXPECT_TRUE(runUntil(loop, [&] { return tiles == 1; }));
  }
  EXPECT_TRUE(runUntil(loop, [&] { return ++silent > 5 && reader.matched() == 0; }));
  EXPECT_EQ(gone, 0);
}

TEST_F(Bus, StrengthDecidesWhoIsHeardAndMayChange) {
  Reader<Detections> reader(here, kTopic<Detections>);
  std::vector<InstanceId> heard;
  loop.on(reader, [&](const Detections& m) { heard.push_back(m.instance); });
  Writer<Detections> weak(there, kTopic<Detections>, {.strength = 1, .lease_s = 20});
  Writer<Detections> strong(there, kTopic<Detections>, {.strength = 2, .lease_s = 20});
  const auto bothWrite = [&] {
    Detections m;
    m.camera = "cam0";
    m.instance = 2;
    EXPECT_TRUE(strong.write(m));
    m.instance = 1;
    EXPECT_TRUE(weak.write(m));
    loop.runOnce(kStep);
  };
  for (int i = 0; i < 3; ++i) bothWrite();
  EXPECT_THAT(heard, ElementsAre(2, 2, 2));
  strong.setStrength(0);
  EXPECT_EQ(strong.strength(), 0);
  heard.clear();
  EXPECT_TRUE(runUntil(loop, [&] {
    bothWrite();
    return !heard.empty() && heard.back() == 1;
  }));
}

TEST_F(Bus, AnOwnerThatLetsTheTopicGoIsFollowedAtOnceByTheNextStrongest) {
  Reader<Detections> reader(here, kTopic<Detections>);
  std::vector<InstanceId> heard;
  loop.on(reader, [&](const Detections& m) { heard.push_back(m.instance); });
  constexpr double kLongLease = 60.0;  // too long to decide these tests
  Writer<Detections> owner(here, kTopic<Detections>, {.strength = 10, .lease_s = kLongLease});
  Writer<Detections> spare(there, kTopic<Detections>, {.strength = 9, .lease_s = kLongLease});
  const auto say = [&](Writer<Detections>& writer, InstanceId who) {
    Detections m;
    m.camera = "cam0";
    m.instance = who;
    EXPECT_TRUE(writer.write(m));
    for (int i = 0; i < 5; ++i) loop.runOnce(kStep);
  };
  ASSERT_TRUE(runUntil(loop, [&] { return reader.matched() == 2; }));
  EXPECT_EQ(reader.strongestBut(owner), 9);
  EXPECT_EQ(reader.strongestBut(spare), 10);
  say(owner, 1), say(spare, 2);
  EXPECT_THAT(heard, ElementsAre(1));
  owner.release();
  say(spare, 2);
  EXPECT_THAT(heard, ElementsAre(1, 2));
  say(owner, 1), say(spare, 2);
  EXPECT_THAT(heard, ElementsAre(1, 2, 1)) << "its next write takes it again";
  spare.setStrength(30);
  EXPECT_TRUE(runUntil(loop, [&] { return reader.strongestBut(owner) == 30; }));
}

TEST_F(Bus, AnOwnerThatMissesItsLeaseIsTold) {
  Reader<Detections> reader(here, kTopic<Detections>);
  Writer<Detections> writer(there, kTopic<Detections>, {.lease_s = 0.1});
  Detections m;
  m.camera = "cam0";
  EXPECT_TRUE(writer.write(m));
  EXPECT_TRUE(runUntil(loop, [&] { return writer.livelinessLost() == 1; }));
  EXPECT_EQ(reportOf(writer).of("detections_liveliness_lost"), 1u);
  EXPECT_TRUE(
      runUntil(loop, [&] { return reportOf(reader).of("detections_writers_silent") == 1; }));
}

TEST_F(Bus, WhoComesLateGetsTheNewestThatIsKeptWhereHeAsks) {
  Writer<Objects> writer(there, kTopic<Objects>);
  for (std::uint64_t sequence : {1, 2, 3}) {
    Objects objects;
    objects.stamp.sequence = sequence;
    ASSERT_TRUE(writer.write(objects));
  }
  Reader<Objects> now(here, kTopic<Objects>), kept(here, kTopic<Objects>, ReadFrom::kKept);
  std::vector<std::uint64_t> got, got_now;
  loop.on(kept, [&](const Objects& m) { got.push_back(m.stamp.sequence); });
  loop.on(now, [&](const Objects& m) { got_now.push_back(m.stamp.sequence); });
  EXPECT_TRUE(runUntil(loop, [&] { return !got.empty() && now.matched() == 1; }));
  EXPECT_THAT(got, ElementsAre(3));
  Objects live;
  live.stamp.sequence = 4;
  ASSERT_TRUE(writer.write(live));
  EXPECT_TRUE(runUntil(loop, [&] { return !got_now.empty(); }));
  EXPECT_THAT(got_now, ElementsAre(4)) << "who does not ask gets nothing of before";
}

TEST_F(Bus, ATickRestsWhileItIsNotWanted) {
  bool wanted = false;
  int ticks = 0, others = 0;
  loop.every(
      kStep, [&] { ++ticks; }, [&] { return wanted; });
  loop.every(10 * kStep, [&] { ++others; });
  ASSERT_TRUE(runUntil(loop, [&] { return others == 1; }));
  EXPECT_EQ(ticks, 0);
  wanted = true;
  EXPECT_TRUE(runUntil(loop, [&] { return ticks > 1; }));
}

TEST_F(Bus, DiscoveryNamesProcessesAndTheirEndpoints) {
  Discovery discovery(here);
  Writer<ImuSample> writer(there, kTopic<ImuSample>);
  EXPECT_TRUE(runUntil(loop, [&] {
    const auto endpoints = discovery.endpoints();
    return std::any_of(endpoints.begin(), endpoints.end(), [](const RemoteEndpoint& e) {
      return e.wire_name == "perdure/ego/imu" && e.writer && e.process == "there" &&
             e.type_name == "perdure::msg::ImuSample";
    });
  }));
  EXPECT_THAT(discovery.participants(), Contains("there"));
}

TEST_F(Bus, AStopEndsTheLoopAfterTheMessageAtWorkAlsoInTheMiddleOfABatch) {
  Reader<ImuSample> reader(here, kTopic<ImuSample>);
  Writer<ImuSample> writer(there, kTopic<ImuSample>);
  for (int i = 0; i < 50; ++i) EXPECT_TRUE(writer.write(ImuSample{}));
  int handled = 0;
  loop.on(reader, [&](const ImuSample&) {
    if (++handled == 3) loop.stop();
  });
  EXPECT_TRUE(runUntil(loop, [&] { return loop.stopped(); }));
  EXPECT_EQ(handled, 3);
}

TEST_F(Bus, TheLoopTicksWakesAndStops) {
  int ticks = 0, wakes = 0;
  loop.every(std::chrono::milliseconds(1), [&] { ++ticks; });
  loop.onWake([&] {
    if (++wakes == 1) loop.stop();
  });
  EXPECT_TRUE(runUntil(loop, [&] { return ticks >= 3; }));
  std::thread other([&] { loop.wake(); });
  loop.run();
  other.join();
  EXPECT_EQ(wakes, 1);
  EXPECT_TRUE(loop.stopped());
}

TEST(BusWithoutInterface, SaysWhichInterfaceItCannotUse) {
  try {
    const Domain domain({.interface = "nosuch0", .domain = 7});
    FAIL() << "must throw";
  } catch (const StartupError& error) {
    EXPECT_EQ(error.code(), ExitCode::kUnavailable);
    EXPECT_NE(std::string(error.what()).find("nosuch0"), std::string::npos);
  }
}

}  // namespace
}  // namespace perdure::bus
