// Optional parts of MCAP files by the specification (mcap.dev/spec). The test writes every
// combination of the features that vary in the public conformance cases. Each is a complete file.
//
//   ch chunks · mx message indexes · chx chunk indexes · st statistics · rsh, rch schemas and
//   channels repeated in the summary · ax, mdx indexes of attachments and metadata · sum summary
//   offsets · pad three bytes after each record's last field
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "common/base/errors.h"
#include "common/replay/recordings/recorded_messages.h"

namespace perdure::replay::mcap {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using Buffer = std::vector<std::uint8_t>;

/// The content of a file.
struct Content {
  const char* name;
  int messages = 0;
  bool schema = true, attachment = false, metadata = false;
};

enum Feature : unsigned {
  kCh = 1,
  kMx = 2,
  kChx = 4,
  kSt = 8,
  kRsh = 16,
  kRch = 32,
  kAx = 64,
  kMdx = 128,
  kSum = 256,
  kPad = 512,
  kAll = 1024
};

std::string nameOf(unsigned features) {
  constexpr const char* kNames[] = {"ch",  "mx", "chx", "st",  "rsh",
                                    "rch", "ax", "mdx", "sum", "pad"};
  std::string name;
  for (unsigned i = 0; i < 10; ++i) {
    if (features & (1u << i)) name += std::string("-") + kNames[i];
  }
  return name;
}

/// Returns whether the file contains the records that each feature needs.
bool isMeant(const Content& content, unsigned f) {
  const bool messages = content.messages > 0;
  if ((f & (kMx | kChx)) && !(f & kCh)) return false;
  if ((f & (kCh | kRch)) && !messages) return false;
  if ((f & kRsh) && !(messages && content.schema)) return false;
  if ((f & kAx) && !content.attachment) return false;
  if ((f & kMdx) && !content.metadata) return false;
  const unsigned groups = kChx | kSt | kRsh | kRch | kAx | kMdx;
  return !(f & kSum) || (f & groups);
}

class FileMaker {
 public:
  FileMaker(const Content& content, unsigned features) : content_(content), f_(features) {}

  Buffer make() {
    Put(file_).bytes(kMagic);
    Buffer header;
    Put{header}("");
    Put{header}("");
    record(file_, Op::kHeader, header);
    if (content_.messages > 0) messages();
    if (content_.attachment) attachment();
    if (content_.metadata) metadata();
    Buffer end;
    Put{end}(std::uint32_t{0});
    record(file_, Op::kDataEnd, end);
    summary();
    return std::move(file_);
  }

 private:
  static constexpr Op kAttachment{0x09}, kAttachmentIndex{0x0A}, kMetadata{0x0C},
      kMetadataIndex{0x0D};

  void record(Buffer& to, Op op, Buffer content) const {
    // The data of a message extend to the end of its record, so that padding would become part of
    // them.
    if ((f_ & kPad) && op != Op::kMessage && op != Op::kFooter) {
      for (const std::uint8_t byte : {0x01, 0xff, 0xff}) content.push_back(byte);
    }
    Put(to).record(op, content);
  }
  void schema(Buffer& to) const {
    if (!content_.schema) return;
    Buffer bytes;
    Put put(bytes);
    put(std::uint16_t{1});
    for (const char* text : {"Example", "c", ""}) put(text);
    record(to, Op::kSchema, bytes);
  }
  void channel(Buffer& to) const {
    Buffer bytes;
    Put put(bytes);
    put(std::uint16_t{1});
    put(std::uint16_t{content_.schema ? std::uint16_t{1} : std::uint16_t{0}});
    for (const char* text : {"example", "a"}) put(text);
    Buffer pairs;
    Put{pairs}("foo");
    Put{pairs}("bar");
    put(static_cast<std::uint32_t>(pairs.size()));
    put.bytes(pairs);
    record(to, Op::kChannel, bytes);
  }
  void message(Buffer& to, int i) const {
    const Buffer data{1, 2, static_cast<std::uint8_t>(i)};
    Buffer bytes;
    Put put(bytes);
    put(std::uint16_t{1});
    put(static_cast<std::uint32_t>(10 + i));
    put(static_cast<std::uint64_t>(2 + i));
    put(static_cast<std::uint64_t>(1 + i));
    put.bytes(data);
    record(to, Op::kMessage, bytes);
  }
  void messages() {
    Buffer records;
    Buffer& to = f_ & kCh ? records : file_;
    schema(to);
    channel(to);
    std::vector<std::pair<std::uint64_t, std::uint64_t>> places;
    for (int i = 0; i < content_.messages; ++i) {
      places.emplace_back(2 + i, to.size());
      message(to, i);
    }
    if (f_ & kCh) chunk(records, places);
  }
  void chunk(const Buffer& records,
             const std::vector<std::pair<std::uint64_t, std::uint64_t>>& places) {
    Buffer bytes;
    Put put(bytes);
    put(places.front().first);
    put(places.back().first);
    put(static_cast<std::uint64_t>(records.size()));
    put(crc(records));
    put("");
    put(static_cast<std::uint64_t>(records.size()));
    put.bytes(records);
    chunk_.start_ns = places.front().first;
    chunk_.end_ns = places.back().first;
    chunk_.packed = chunk_.unpacked = records.size();
    chunk_.offset = file_.size();
    record(file_, Op::kChunk, bytes);
    chunk_.length = file_.size() - chunk_.offset;
    if (!(f_ & kMx)) return;
    Buffer index;
    Put in_index(index);
    in_index(std::uint16_t{1});
    in_index(static_cast<std::uint32_t>(16 * places.size()));
    for (const auto& [log_ns, offset] : places) {
      in_index(log_ns);
      in_index(offset);
    }
    chunk_.index_offsets[1] = file_.size();
    record(file_, Op::kMessageIndex, index);
    chunk_.index_length = file_.size() - chunk_.index_offsets[1];
  }
  void attachment() {
    Buffer bytes;
    Put put(bytes);
    put(std::uint64_t{2});
    put(std::uint64_t{1});
    put("myFile");
    put("application/octet-stream");
    put(std::uint64_t{3});
    put.bytes(Buffer{1, 2, 3});
    put(crc(bytes));
    at_ = file_.size();
    record(file_, kAttachment, bytes);
    length_ = file_.size() - at_;
  }
  void metadata() {
    Buffer bytes, pairs;
    Put{pairs}("test");
    Put{pairs}("testValue");
    Put put(bytes);
    put("myMetadata");
    put(static_cast<std::uint32_t>(pairs.size()));
    put.bytes(pairs);
    at_ = file_.size();
    record(file_, kMetadata, bytes);
    length_ = file_.size() - at_;
  }

  template <class Add>
  void group(Op op, bool wanted, Add&& add) {
    if (!wanted) return;
    const std::size_t from = file_.size();
    add();
    Buffer bytes;
    Put put(bytes);
    put(static_cast<std::uint8_t>(op));
    put(static_cast<std::uint64_t>(from));
    put(static_cast<std::uint64_t>(file_.size() - from));
    record(offsets_, Op::kSummaryOffset, bytes);
  }
  void statistics() {
    Buffer bytes;
    Put put(bytes);
    put(static_cast<std::uint64_t>(content_.messages));
    const bool any = content_.messages > 0;
    put(static_cast<std::uint16_t>(any && content_.schema ? 1 : 0));
    put(std::uint32_t{any ? 1u : 0u});
    put(std::uint32_t{content_.attachment ? 1u : 0u});
    put(std::uint32_t{content_.metadata ? 1u : 0u});
    put(std::uint32_t{f_ & kCh ? 1u : 0u});
    put(std::uint64_t{any ? 2u : 0u});
    put(static_cast<std::uint64_t>(any ? 1 + content_.messages : 0));
    std::map<std::uint16_t, std::uint64_t> by_channel;
    if (any) by_channel[1] = static_cast<std::uint64_t>(content_.messages);
    put(by_channel);
    record(file_, Op::kStatistics, bytes);
  }
  void chunkIndex() {
    Buffer whole;
    putRecord(whole, chunk_);
    record(file_, Op::kChunkIndex, {whole.begin() + kRecordHead, whole.end()});
  }
  void placeIndex(Op op) {
    Buffer bytes;
    Put put(bytes);
    put(static_cast<std::uint64_t>(at_));
    put(static_cast<std::uint64_t>(length_));
    if (op == kAttachmentIndex) {
      put(std::uint64_t{2});
      put(std::uint64_t{1});
      put(std::uint64_t{3});
      put("myFile");
      put("application/octet-stream");
    } else {
      put("myMetadata");
    }
    record(file_, op, bytes);
  }
  void summary() {
    const std::uint64_t from = file_.size();
    group(Op::kSchema, f_ & kRsh, [&] { schema(file_); });
    group(Op::kChannel, f_ & kRch, [&] { channel(file_); });
    group(Op::kStatistics, f_ & kSt, [&] { statistics(); });
    group(kMetadataIndex, f_ & kMdx, [&] { placeIndex(kMetadataIndex); });
    group(kAttachmentIndex, f_ & kAx, [&] { placeIndex(kAttachmentIndex); });
    group(Op::kChunkIndex, f_ & kChx, [&] { chunkIndex(); });
    const bool any = file_.size() > from, sum = (f_ & kSum) && any;
    const std::uint64_t offsets_at = file_.size();
    if (sum) Put(file_).bytes(offsets_);
    Buffer footer;
    Put put(footer);
    put(any ? from : std::uint64_t{0});
    put(sum ? offsets_at : std::uint64_t{0});
    put(std::uint32_t{0});
    record(file_, Op::kFooter, footer);
    Put(file_).bytes(kMagic);
  }

  Content content_;
  unsigned f_;
  Buffer file_, offsets_;
  ChunkIndex chunk_;
  std::size_t at_ = 0, length_ = 0;
};

class McapConformance : public testing::TestWithParam<Content> {
 protected:
  void SetUp() override {
    file_ =
        fs::path(testing::TempDir()) / (std::string("conformance-") + GetParam().name + ".mcap");
  }
  void TearDown() override { fs::remove(file_); }
  void write(const Buffer& bytes) const {
    std::ofstream(file_, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()),
               static_cast<std::streamsize>(bytes.size()));
  }
  /// Compares the records that are read with the content that was written.
  void expectAllOfIt(const std::string& variant) const {
    const Content& content = GetParam();
    if (content.messages == 0) {
      try {
        RecordedMessages recording(file_);
        ADD_FAILURE() << variant << " holds no messages";
      } catch (const StartupError& error) {
        EXPECT_THAT(error.what(), HasSubstr("holds no messages"));
        EXPECT_THAT(error.what(), testing::Not(HasSubstr("lost"))) << variant;
      }
      return;
    }
    RecordedMessages recording(file_);
    EXPECT_TRUE(recording.reasons().all().empty()) << variant << recording.lastProblem();
    ASSERT_TRUE(recording.topics().contains("example")) << variant;
    const auto& topic = recording.topics().at("example");
    EXPECT_EQ(topic.messages, static_cast<std::uint64_t>(content.messages)) << variant;
    EXPECT_EQ(topic.type, content.schema ? "Example" : "") << variant;
    for (int i = 0; i < content.messages; ++i) {
      const auto message = recording.next();
      ASSERT_TRUE(message) << variant << " message " << i;
      EXPECT_EQ(message->log_ns, static_cast<std::uint64_t>(2 + i)) << variant;
      EXPECT_THAT(message->data, testing::ElementsAre(1, 2, i)) << variant;
    }
    EXPECT_FALSE(recording.next()) << variant;
    EXPECT_TRUE(recording.reasons().all().empty()) << variant;
  }

  fs::path file_;
};

TEST_P(McapConformance, EveryVariantIsWholeAndGivesAllOfIt) {
  int variants = 0;
  for (unsigned features = 0; features < kAll; ++features) {
    if (!isMeant(GetParam(), features)) continue;
    ++variants;
    const std::string variant = GetParam().name + nameOf(features);
    write(FileMaker(GetParam(), features).make());
    const auto reader = Reader::open(file_);
    ASSERT_TRUE(reader) << variant;
    EXPECT_TRUE(reader->finished()) << variant;
    EXPECT_EQ(reader->cutBytes(), 0U) << variant;
    expectAllOfIt(variant);
  }
  EXPECT_GE(variants, 6);
}

TEST_P(McapConformance, EveryVariantThatIsCutIsNotWhole) {
  for (unsigned features = 0; features < kAll; ++features) {
    if (!isMeant(GetParam(), features)) continue;
    auto bytes = FileMaker(GetParam(), features).make();
    bytes.resize(bytes.size() - 9);
    write(bytes);
    const auto reader = Reader::open(file_);
    ASSERT_TRUE(reader);
    EXPECT_FALSE(reader->finished()) << GetParam().name << nameOf(features);
  }
}

TEST_P(McapConformance, RecordsOfUnknownKindsArePassedOver) {
  auto bytes = FileMaker(GetParam(), 0).make();
  Buffer unknown;
  Put(unknown).record(Op{0x7F}, Buffer{1, 2, 3, 4});
  Put(unknown).record(Op{0x81}, {});
  const std::ptrdiff_t behind_header = 8 + 9 + 8;
  bytes.insert(bytes.begin() + behind_header, unknown.begin(), unknown.end());
  write(bytes);
  EXPECT_TRUE(Reader::open(file_)->finished());
  expectAllOfIt("unknown kinds");
}

INSTANTIATE_TEST_SUITE_P(Contents, McapConformance,
                         testing::Values(Content{"NoData"}, Content{"OneMessage", 1},
                                         Content{"TenMessages", 10},
                                         Content{"OneSchemalessMessage", 1, false},
                                         Content{"OneAttachment", 0, true, true},
                                         Content{"OneMetadata", 0, true, false, true}),
                         [](const auto& one) { return std::string(one.param.name); });

TEST(McapOfOthers, AChunkThatCannotBeReadSaysWhy) {
  const fs::path file = fs::path(testing::TempDir()) / "conformance-packed.mcap";
  Buffer bytes(kMagic.begin(), kMagic.end()), chunk;
  Put put(chunk);
  put(std::uint64_t{1});
  put(std::uint64_t{1});
  put(std::uint64_t{3});
  put(std::uint32_t{0});
  put("xz");
  put(std::uint64_t{2});
  put.bytes(Buffer{1, 2});
  Put(bytes).record(Op::kChunk, chunk);
  std::ofstream(file, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()),
             static_cast<std::streamsize>(bytes.size()));
  try {
    RecordedMessages recording(file);
    FAIL();
  } catch (const StartupError& error) {
    EXPECT_THAT(error.what(), HasSubstr("compress --compression zstd"));
  }
  fs::remove(file);
}

}  // namespace
}  // namespace perdure::replay::mcap
