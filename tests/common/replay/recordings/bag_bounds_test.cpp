// Chunks of a bag with overlapping times are unpacked together, up to 1 GiB. The test writes the
// bags according to the format's description; each chunk is 60 MiB of compressed zeros.
#include <bzlib.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <fstream>

#include "common/replay/recordings/ros_messages.h"
#include "tests/common/replay/tiny_datasets.h"

namespace perdure::replay {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kFiller = 60U << 20U;

std::string little(std::uint64_t value, int bytes) {
  std::string text;
  for (int i = 0; i < bytes; ++i) text += static_cast<char>(value >> (8 * i));
  return text;
}

std::string fields(const std::vector<std::pair<std::string, std::string>>& all) {
  std::string text;
  for (const auto& [name, value] : all) {
    const std::string field = name + "=" + value;
    text += little(field.size(), 4) + field;
  }
  return text;
}

std::string record(const std::string& head, const std::string& data) {
  return little(head.size(), 4) + head + little(data.size(), 4) + data;
}

std::string connection(std::uint32_t number, const std::string& topic) {
  return record(fields({{"op", "\x07"}, {"conn", little(number, 4)}, {"topic", topic}}),
                fields({{"topic", topic}, {"type", "std_msgs/String"}, {"md5sum", "*"}}));
}

std::string message(std::uint32_t number, std::uint32_t second, const std::string& data) {
  return record(fields({{"op", "\x02"},
                        {"conn", little(number, 4)},
                        {"time", little(second, 4) + little(0, 4)}}),
                data);
}

/// One message of a wanted topic, then one of an unwanted topic.
std::string packedChunk(std::uint32_t second) {
  const std::string bytes = connection(0, "/wanted") + connection(1, "/filler") +
                            message(0, second, "0123") +
                            message(1, second, std::string(kFiller, 0));
  std::string packed(1U << 20U, 0);
  auto size = static_cast<unsigned int>(packed.size());
  EXPECT_EQ(BZ2_bzBuffToBuffCompress(packed.data(), &size, const_cast<char*>(bytes.data()),
                                     static_cast<unsigned int>(bytes.size()), 9, 0, 0),
            BZ_OK);
  packed.resize(size);
  const std::string head =
      fields({{"op", "\x05"}, {"compression", "bz2"}, {"size", little(bytes.size(), 4)}});
  return record(head, packed);
}

fs::path bagOf(const std::string& name, std::size_t chunks, bool overlap) {
  const fs::path file = freshFolder(name) / "bounds.bag";
  std::ofstream out(file, std::ios::binary);
  std::string head = fields({{"op", "\x03"},
                             {"index_pos", little(0, 8)},
                             {"conn_count", little(0, 4)},
                             {"chunk_count", little(0, 4)}});
  out << "#ROSBAG V2.0\n" << record(head, std::string(4096 - 8 - head.size(), ' '));
  std::string same;
  for (std::size_t i = 0; i < chunks; ++i) {
    if (same.empty() || !overlap)
      same = packedChunk(overlap ? 1 : static_cast<std::uint32_t>(i + 1));
    out << same;
  }
  return file;
}

std::size_t messagesIn(RosSource& bag) {
  bag.rewind({"/wanted"}, 0);
  std::size_t count = 0;
  while (bag.next()) ++count;
  return count;
}

TEST(LongBagBounds, MoreThanAGiBOfOverlappingChunksIsRefusedWithTheFix) {
  const fs::path file = bagOf("bag_overlap", 20, true);
  EXPECT_LT(fs::file_size(file), 1U << 20U) << "what is small on the disk";
  const auto bag = openBag(file);
  const std::string why = startupErrorOf([&] { messagesIn(*bag); });
  EXPECT_THAT(why, testing::HasSubstr("the times of more than 1 GiB of its chunks overlap"));
  EXPECT_THAT(why, testing::HasSubstr("rosbag filter IN OUT True"));
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  EXPECT_LT(usage.ru_maxrss, 1400 * 1024) << "KiB";
}

TEST(LongBagBounds, AsManyChunksOneAfterAnotherAreRead) {
  const auto bag = openBag(bagOf("bag_in_turn", 20, false));
  EXPECT_EQ(messagesIn(*bag), 20U);
}

}  // namespace
}  // namespace perdure::replay
