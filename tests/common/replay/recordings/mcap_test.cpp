// Tests the MCAP container: written files are read again, whole, truncated at any byte, or with
// changed bytes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <random>

#include "common/replay/recordings/mcap_reader.h"

namespace perdure::replay::mcap {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;

std::vector<std::uint8_t> contentsOf(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

void write(const fs::path& file, const std::vector<std::uint8_t>& bytes) {
  std::ofstream(file, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()),
             static_cast<std::streamsize>(bytes.size()));
}

class Mcap : public testing::Test {
 protected:
  void SetUp() override {
    file = fs::path(testing::TempDir()) /
           (std::string("mcap-") + testing::UnitTest::GetInstance()->current_test_info()->name() +
            ".mcap");
    fs::remove(file);
    catalogue.schemas[1] = {1, "perdure::msg::Imu", "omgidl", "struct Imu {};"};
    catalogue.schemas[2] = {2, "perdure::msg::Odometry", "omgidl", "struct Odometry {};"};
    catalogue.channels[1] = {1, 1, "perdure/ego/imu", "cdr"};
    catalogue.channels[2] = {2, 2, "perdure/ego/odometry", "cdr", {{"key", "value"}}};
  }
  void TearDown() override { fs::remove(file); }

  /// Five chunks of twenty messages on two channels. The data of each message are its number.
  static Draft draftOf(int chunk) {
    Draft draft;
    for (int i = 0; i < 20; ++i) {
      const auto n = static_cast<std::uint32_t>(20 * chunk + i);
      std::vector<std::uint8_t> data(40, static_cast<std::uint8_t>(n));
      draft.add(
          {static_cast<std::uint16_t>(i % 4 == 0 ? 2 : 1), n, 1000u * n, 1000u * n + 7, data});
    }
    return draft;
  }
  std::uint64_t writeChunks(bool finish) {
    auto writer = Writer::create(file);
    for (int i = 0; i < 5; ++i) EXPECT_TRUE(writer->append(pack(draftOf(i)), catalogue));
    const std::uint64_t data_end = writer->size();
    if (finish) (void)writer->finish();
    return data_end;
  }
  /// Returns the sequence numbers of all readable messages.
  static std::vector<std::uint32_t> numbersIn(const Reader& reader) {
    std::vector<std::uint32_t> numbers;
    for (const ChunkIndex& chunk : reader.chunks()) {
      const auto records = reader.unpack(chunk);
      if (!records) continue;
      Catalogue found;
      forEachMessage(
          **records,
          [&](const Message& message, std::uint64_t) { numbers.push_back(message.sequence); },
          found);
    }
    return numbers;
  }

  fs::path file;
  Catalogue catalogue;
};

TEST_F(Mcap, AFinishedFileIsReadByItsSummary) {
  writeChunks(true);
  const auto reader = Reader::open(file);
  ASSERT_TRUE(reader) << reader.error().detail;
  EXPECT_TRUE(reader->finished());
  EXPECT_EQ(reader->catalogue().schemas, catalogue.schemas);
  EXPECT_EQ(reader->catalogue().channels, catalogue.channels);
  EXPECT_EQ(reader->statistics().messages, 100u);
  EXPECT_EQ(reader->statistics().by_channel.at(2), 25u);
  EXPECT_EQ(reader->statistics().start_ns, 0u);
  EXPECT_EQ(reader->statistics().end_ns, 99'000u);
  ASSERT_EQ(reader->chunks().size(), 5u);
  EXPECT_EQ(reader->chunks()[3].start_ns, 60'000u);
  const auto numbers = numbersIn(*reader);
  ASSERT_EQ(numbers.size(), 100u);
  for (std::uint32_t i = 0; i < 100; ++i) EXPECT_EQ(numbers[i], i);
}

TEST_F(Mcap, EveryFieldOfAMessageComesBack) {
  writeChunks(true);
  const auto reader = Reader::open(file);
  const auto records = reader->unpack(reader->chunks()[1]);
  ASSERT_TRUE(records);
  Catalogue found;
  std::optional<Message> first;
  forEachMessage(
      **records, [&](const Message& m, std::uint64_t) { first = first.value_or(m); }, found);
  EXPECT_EQ(first->channel, 2);
  EXPECT_EQ(first->sequence, 20u);
  EXPECT_EQ(first->log_ns, 20'000u);
  EXPECT_EQ(first->publish_ns, 20'007u);
  EXPECT_EQ(first->data.size(), 40u);
  EXPECT_EQ(first->data[39], 20);
}

TEST_F(Mcap, AFileThatIsCutAnywhereYieldsEveryWholeChunk) {
  writeChunks(false);
  const auto whole = contentsOf(file);
  std::vector<std::uint64_t> ends;  // ends of the chunks
  {
    const auto reader = Reader::open(file);
    for (const ChunkIndex& chunk : reader->chunks()) ends.push_back(chunk.offset + chunk.length);
  }
  ASSERT_EQ(ends.size(), 5u);
  for (std::size_t size = 8; size <= whole.size(); size += 3) {
    write(file, {whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size)});
    const auto reader = Reader::open(file);
    ASSERT_TRUE(reader) << size;
    EXPECT_FALSE(reader->finished());
    const auto chunks = static_cast<std::size_t>(
        std::count_if(ends.begin(), ends.end(), [&](std::uint64_t end) { return end <= size; }));
    EXPECT_EQ(reader->chunks().size(), chunks) << size;
    EXPECT_EQ(numbersIn(*reader).size(), 20 * chunks) << size;
  }
}

TEST_F(Mcap, ACutFileIsFinishedInPlaceWithAllItsIndexes) {
  const std::uint64_t data_end = writeChunks(false);
  const auto whole = contentsOf(file);
  for (const std::uint64_t size : {data_end, data_end - 1, data_end - 700, std::uint64_t{8}}) {
    write(file, {whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size)});
    std::size_t messages = 0;
    {
      auto reader = Reader::open(file);
      messages = numbersIn(*reader).size();
      ASSERT_TRUE(reader->finish());
    }
    const auto reader = Reader::open(file);
    ASSERT_TRUE(reader);
    EXPECT_TRUE(reader->finished()) << size;
    EXPECT_EQ(reader->statistics().messages, messages);
    EXPECT_EQ(numbersIn(*reader).size(), messages);
    for (const ChunkIndex& chunk : reader->chunks()) EXPECT_EQ(chunk.index_offsets.size(), 2u);
  }
}

TEST_F(Mcap, AChunkWithAChangedByteIsLeftOutAndTheOthersAreRead) {
  writeChunks(true);
  auto bytes = contentsOf(file);
  std::uint64_t at = 0;
  {
    const auto reader = Reader::open(file);
    at = reader->chunks()[2].offset + reader->chunks()[2].length - 5;
  }
  bytes[at] ^= 0x10;
  write(file, bytes);
  const auto reader = Reader::open(file);
  const auto damaged = reader->unpack(reader->chunks()[2]);
  ASSERT_FALSE(damaged);
  EXPECT_EQ(damaged.error().code, "chunk_damaged");
  EXPECT_THAT(damaged.error().detail, HasSubstr(file.filename().string()));
  EXPECT_EQ(numbersIn(*reader).size(), 80u);
}

TEST_F(Mcap, AnyBytesGiveAReasonOrMessagesThatWereWritten) {
  writeChunks(true);
  const auto whole = contentsOf(file);
  std::mt19937_64 random(5);
  int opened = 0, hurt = 0;
  for (int i = 0; i < 1500; ++i) {
    auto bytes = whole;
    for (std::uint64_t n = 1 + random() % 5; n > 0; --n) {
      // Damaged lengths and offsets are the greatest risk for a reader; they include large numbers.
      const std::size_t at = random() % bytes.size();
      bytes[at] = random() % 3 == 0 ? 0xFF : static_cast<std::uint8_t>(random());
    }
    if (random() % 3 == 0) bytes.resize(random() % (bytes.size() + 1));
    write(file, bytes);
    auto reader = Reader::open(file);
    if (!reader) continue;
    ++opened;
    const auto numbers = numbersIn(*reader);
    if (numbers.size() != 100) ++hurt;
    if (i % 10 == 0) (void)reader->finish();
  }
  EXPECT_GT(opened, 1000);
  EXPECT_GT(hurt, 300);
}

TEST_F(Mcap, WhatIsNoRecordingIsRefused) {
  write(file, {'P', 'N', 'G', 0, 1, 2, 3, 4, 5, 6});
  EXPECT_EQ(Reader::open(file).error().code, "not_mcap");
  EXPECT_EQ(Reader::open(file.parent_path() / "nowhere.mcap").error().code, "file");
  EXPECT_EQ(Reader::open(file.parent_path()).error().code, "file");
}

TEST_F(Mcap, AnEmptyFileIsARecordingWithoutMessages) {
  write(file, {});
  auto reader = Reader::open(file);
  ASSERT_TRUE(reader);
  EXPECT_TRUE(reader->chunks().empty());
  ASSERT_TRUE(reader->finish());
  EXPECT_TRUE(Reader::open(file)->finished());
}

TEST_F(Mcap, MessagesOutsideOfChunksAreReadToo) {
  std::vector<std::uint8_t> bytes(kMagic.begin(), kMagic.end());
  putRecord(bytes, catalogue.schemas[1]);
  putRecord(bytes, catalogue.channels[1]);
  const std::vector<std::uint8_t> data{1, 2, 3};
  for (std::uint32_t i = 0; i < 3; ++i) putMessage(bytes, {1, i, 10 * i, 0, data});
  write(file, bytes);
  const auto reader = Reader::open(file);
  ASSERT_TRUE(reader);
  EXPECT_THAT(numbersIn(*reader), ElementsAre(0, 1, 2));
}

TEST_F(Mcap, AFileIsNotWrittenOver) {
  writeChunks(true);
  const auto again = Writer::create(file);
  ASSERT_FALSE(again);
  EXPECT_THAT(again.error().detail, HasSubstr("File exists"));
}

}  // namespace
}  // namespace perdure::replay::mcap
