// Frames are read in Cyclone's memory: every field, at every length of name and image, and nothing
// beyond the end of truncated data.
#include <gtest/gtest.h>

#include "common/bus/dds.h"
#include "common/bus/sample.h"
#include "common/bus/wait_loop.h"
#include "common/wire/frame_in_place.h"
#include "common/wire/json.h"
#include "tests/common/wire/examples.h"

namespace perdure::bus {
namespace {

class FramesInPlace : public testing::Test {
 protected:
  Domain domain{Options{}};
  Participant here{domain, "here"}, there{domain, "there"};

  static Frame example(unsigned seed) {
    Frame frame;
    wire::Examples(seed).fill(frame);
    return frame;
  }
};

TEST_F(FramesInPlace, ComeAsTheyWereWritten) {
  Reader<Frame> reader(here, frameTopic("cam0"));
  Writer<Frame> writer(there, frameTopic("cam0"));
  WaitLoop loop(here);
  std::vector<Frame> got;
  loop.on(reader, [&](const Frame& frame) { got.push_back(frame); });
  constexpr unsigned kFrames = 40;
  for (unsigned i = 0; i < kFrames; ++i) {
    ASSERT_TRUE(writer.write(example(i)));
    for (int wait = 0; wait < 500 && got.size() <= i; ++wait) {
      loop.runOnce(std::chrono::milliseconds(20));
    }
    ASSERT_EQ(got.size(), i + 1);
  }
  for (unsigned i = 0; i < kFrames; ++i) {  // while the test holds all of them
    const Frame sent = example(i);
    EXPECT_EQ(wire::toJson(got[i]), wire::toJson(sent));
    EXPECT_TRUE(
        std::equal(got[i].data->begin(), got[i].data->end(), sent.data->begin(), sent.data->end()));
  }
}

TEST_F(FramesInPlace, StayWhenTheirReaderAndItsParticipantAreGone) {
  Frame kept;
  {
    const Participant other(domain, "other");
    Reader<Frame> reader(other, frameTopic("cam0"));
    Writer<Frame> writer(there, frameTopic("cam0"));
    ASSERT_TRUE(writer.write(example(5)));
    for (int wait = 0; wait < 500 && !kept.data; ++wait) {
      reader.drain([&](const Frame& frame) { kept = frame; });
      dds_sleepfor(DDS_MSECS(10));
    }
  }
  ASSERT_TRUE(kept.data);
  EXPECT_EQ(wire::toJson(kept), wire::toJson(example(5)));
}

TEST_F(FramesInPlace, AreAsLargeAsIsToldAndRefusedWhereTheyAreCutOff) {
  const auto type = &perdure_msg_Frame_desc;
  const Entity topic(dds_create_topic(here.handle(), type, "sizes", nullptr, nullptr));
  const auto reader =
      here.keep(Entity(dds_create_reader(here.handle(), topic.handle(), nullptr, nullptr)));
  const Entity writer(dds_create_writer(here.handle(), topic.handle(), nullptr, nullptr));
  wire::Arena arena;
  for (unsigned seed = 0; seed < 40; ++seed) {
    const Frame frame = example(seed);
    perdure_msg_Frame sample;
    ASSERT_TRUE(wire::encode(frame, sample, arena));
    ASSERT_EQ(dds_write(writer.handle(), &sample), DDS_RETCODE_OK);
    const auto taken = takeInPlace(reader, 1);
    ASSERT_EQ(taken.size(), 1U);
    const auto cdr = taken[0].cdr;
    const std::size_t size = wire::sizeInPlace(sample);
    EXPECT_GE(cdr.size(), size);
    EXPECT_LT(cdr.size(), size + 4) << "padded to words";
    EXPECT_TRUE(wire::decodeInPlace<Frame>(cdr, taken[0].keeper));
    for (std::size_t n = 0; n < size; ++n) {
      EXPECT_FALSE(wire::decodeInPlace<Frame>(cdr.first(n), taken[0].keeper)) << n;
    }
  }
}

}  // namespace
}  // namespace perdure::bus
