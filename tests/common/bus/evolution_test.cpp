// Programs of the first version of the IDL together with present ones: each reads the other's
// messages.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <tuple>
#include <vector>

#include "common/bus/dds.h"
#include "common/bus/wait_loop.h"
#include "common/wire/cdr.h"
#include "tests/common/bus/first_objects.h"
#include "tests/common/bus/isolation.h"
#include "tests/common/wire/examples.h"

namespace perdure::bus {
namespace {

/// Waits until `done` returns true, but at most ten seconds.
template <class Done>
bool eventually(WaitLoop& loop, Done done) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(10);
  while (!done() && std::chrono::steady_clock::now() < end) {
    loop.runOnce(std::chrono::milliseconds(20));
  }
  return done();
}

class Evolution : public testing::Test {
 protected:
  /// The topic as a program of the first version declares it.
  dds_entity_t firstTopic() const {
    return topicAs<Objects>(perdure_first_Objects_desc, "objects");
  }
  template <class T>
  dds_entity_t topicAs(dds_topic_descriptor_t first, const char* name) const {
    first.m_typename = wire::Type<T>::descriptor().m_typename;
    return dds_create_topic(there.handle(), &first, there.wireName(name).c_str(), nullptr, nullptr);
  }
  static QosPtr reliable() {
    QosPtr qos(dds_create_qos());
    dds_qset_reliability(qos.get(), DDS_RELIABILITY_RELIABLE, DDS_SECS(1));
    dds_qset_history(qos.get(), DDS_HISTORY_KEEP_LAST, 8);
    return qos;
  }

  Domain domain{Options{}};
  Participant here{domain, "today"}, there{domain, "first"};
  WaitLoop loop{here};
};

TEST_F(Evolution, ABeliefOfTheFirstVersionHasAnEmptyLedgerAndItsOwnTrack) {
  Reader<Objects> reader(here, kTopic<Objects>);
  std::vector<Objects> got;
  loop.on(reader, [&](const Objects& m) { got.push_back(m); });
  const dds_entity_t writer =
      dds_create_writer(there.handle(), firstTopic(), reliable().get(), nullptr);
  ASSERT_GT(writer, 0);
  ASSERT_TRUE(eventually(loop, [&] { return reader.matched() == 1; }));

  std::vector<perdure_first_ObjectBelief> items(2);
  std::string name = "car";
  perdure_first_ClassBelief car{};
  car.name = name.data();
  car.probability = 1.0;
  for (int i = 0, next = 0; i < 7; next += 7 - i, ++i) car.covariance[next] = 1.0;
  for (std::size_t i = 0; i < items.size(); ++i) {
    items[i].object_id = 10 + i;
    items[i].existence = 0.5;
    items[i].classes = {1, 1, &car, false};
    items[i].hits = 7;
    items[i].recalled = true;
  }
  perdure_first_Objects message{};
  message.source = 99;
  message.T_WB.q[3] = message.up_W[2] = 1.0;
  message.items = {2, 2, items.data(), false};
  ASSERT_EQ(dds_write(writer, &message), DDS_RETCODE_OK);
  ASSERT_TRUE(eventually(loop, [&] { return !got.empty(); }));
  // The messages that a recording of that version contains.
  const auto recorded =
      wire::decodeCdr<Objects>(wire::writeCdr(&message, perdure_first_Objects_desc), nullptr);
  ASSERT_TRUE(recorded) << recorded.error().detail;
  got.push_back(*recorded);
  for (const Objects& read : got) {
    ASSERT_EQ(read.objects.size(), 2u);
    EXPECT_EQ(read.instance, 99u);
    EXPECT_TRUE(read.pose_error.isZero(0.0));
    EXPECT_EQ(read.near_source, 0u);
    EXPECT_EQ(read.near_revision, 0u);
    EXPECT_EQ(read.near_m, 0.0) << "it asks the map for nothing";
    EXPECT_TRUE(read.ended.empty());
    for (std::size_t i = 0; i < 2; ++i) {
      EXPECT_EQ(read.objects[i].id, 10 + i);
      EXPECT_EQ(read.objects[i].best().name, "car");
      EXPECT_EQ(read.objects[i].hits, 7u);
      EXPECT_TRUE(read.objects[i].recalled);
      EXPECT_TRUE(read.objects[i].why.empty());
      EXPECT_TRUE(read.objects[i].why.classes.empty());
      EXPECT_EQ(read.objects[i].track, 0u);
      EXPECT_EQ(read.objects[i].trackId(), 10 + i);
    }
  }
}

TEST_F(Evolution, AProgramOfTheFirstVersionReadsABeliefWithALedgerAndATrack) {
  const dds_entity_t reader =
      dds_create_reader(there.handle(), firstTopic(), reliable().get(), nullptr);
  ASSERT_GT(reader, 0);
  Writer<Objects> writer(here, kTopic<Objects>);
  ASSERT_TRUE(eventually(loop, [&] { return writer.matched() == 1; }));
  wire::Examples examples(3);
  Objects message;
  while (message.objects.size() < 3) message.objects.push_back(examples.belief());
  ASSERT_FALSE(message.objects[0].why.empty());
  message.objects[1].track = 77;
  message.near_source = message.near_revision = 5;
  message.near_m = 60.0;
  message.ended = {examples.endedTrack(), examples.endedTrack()};
  ASSERT_TRUE(writer.write(message));
  void* sample = nullptr;
  dds_sample_info_t info{};
  ASSERT_TRUE(
      eventually(loop, [&] { return sample || dds_take(reader, &sample, &info, 1, 1) > 0; }));
  ASSERT_TRUE(info.valid_data);
  const auto& got = *static_cast<const perdure_first_Objects*>(sample);
  ASSERT_EQ(got.items._length, 3u);
  for (std::uint32_t i = 0; i < 3; ++i) {
    const auto& [read, sent] = std::tie(got.items._buffer[i], message.objects[i]);
    EXPECT_EQ(read.object_id, sent.id);
    EXPECT_EQ(read.existence, sent.existence);
    EXPECT_EQ(read.recalled, sent.recalled);
    EXPECT_EQ(read.classes._length, sent.classes.size());
    EXPECT_STREQ(read.classes._buffer[0].name, sent.best().name.c_str());
  }
  dds_return_loan(reader, &sample, 1);
}

TEST_F(Evolution, AnAnswerOfAMapStoreThatTellsNoGraphHasNone) {
  Reader<MapReply> reader(here, kTopic<MapReply>);
  std::vector<MapReply> got;
  loop.on(reader, [&](const MapReply& m) { got.push_back(m); });
  const dds_entity_t writer =
      dds_create_writer(there.handle(), topicAs<MapReply>(perdure_first_MapReply_desc, "map/reply"),
                        reliable().get(), nullptr);
  ASSERT_GT(writer, 0);
  ASSERT_TRUE(eventually(loop, [&] { return reader.matched() == 1; }));
  perdure_first_MapReply message{};
  std::string error = "no such kind";
  message.request = 7;
  message.error = error.data();
  message.truncated = true;
  ASSERT_EQ(dds_write(writer, &message), DDS_RETCODE_OK);
  ASSERT_TRUE(eventually(loop, [&] { return !got.empty(); }));
  const auto recorded =
      wire::decodeCdr<MapReply>(wire::writeCdr(&message, perdure_first_MapReply_desc), nullptr);
  ASSERT_TRUE(recorded) << recorded.error().detail;
  got.push_back(*recorded);
  for (const MapReply& read : got) {
    EXPECT_EQ(read.request, 7u);
    EXPECT_EQ(read.error, error);
    EXPECT_TRUE(read.truncated);
    EXPECT_TRUE(read.anchors.empty() && read.loops.empty());
    EXPECT_EQ(read.anchor_count, 0u);
  }
}

TEST_F(Evolution, AnAnswerWithAGraphIsReadByProgramsThatKnowNone) {
  const dds_entity_t reader =
      dds_create_reader(there.handle(), topicAs<MapReply>(perdure_first_MapReply_desc, "map/reply"),
                        reliable().get(), nullptr);
  ASSERT_GT(reader, 0);
  Writer<MapReply> writer(here, kTopic<MapReply>);
  ASSERT_TRUE(eventually(loop, [&] { return writer.matched() == 1; }));
  wire::Examples examples(5);
  MapReply message;
  message.request = 8;
  message.objects = {examples.mapObject(), examples.mapObject()};
  message.anchors = {examples.mapAnchor(), examples.mapAnchor()};
  message.loops = {examples.mapLoop()};
  ASSERT_TRUE(writer.write(message));
  void* sample = nullptr;
  dds_sample_info_t info{};
  ASSERT_TRUE(
      eventually(loop, [&] { return sample || dds_take(reader, &sample, &info, 1, 1) > 0; }));
  ASSERT_TRUE(info.valid_data);
  const auto& got = *static_cast<const perdure_first_MapReply*>(sample);
  EXPECT_EQ(got.request, 8u);
  ASSERT_EQ(got.items._length, 2u);
  EXPECT_EQ(got.items._buffer[1].object_id, message.objects[1].id);
  dds_return_loan(reader, &sample, 1);
}

}  // namespace
}  // namespace perdure::bus
