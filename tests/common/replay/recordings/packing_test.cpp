// Chunks as other programs compress them: at once, as a stream (no size in zstd's frame), in
// several frames, by LZ4, with damage.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <lz4frame.h>
#include <zstd.h>

#include <chrono>
#include <filesystem>
#include <fstream>

#include "common/replay/recordings/mcap_reader.h"
#include "common/replay/recordings/unpack.h"

namespace perdure::replay::mcap {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using Buffer = std::vector<std::uint8_t>;

constexpr std::uint32_t kMessages = 3000;  // several megabytes: more than one step

Buffer zstdInOneGo(const Buffer& bytes) {
  Buffer packed(ZSTD_compressBound(bytes.size()));
  packed.resize(ZSTD_compress(packed.data(), packed.size(), bytes.data(), bytes.size(), 1));
  return packed;
}

/// A zstd frame without its content size, as writers in Rust and Go make it.
Buffer zstdAsItGoes(const Buffer& bytes) {
  ZSTD_CCtx* context = ZSTD_createCCtx();
  Buffer packed(ZSTD_compressBound(bytes.size()) + 100);
  ZSTD_outBuffer out{packed.data(), packed.size(), 0};
  for (std::size_t at = 0; at < bytes.size(); at += 10'000) {
    ZSTD_inBuffer in{bytes.data() + at, std::min<std::size_t>(10'000, bytes.size() - at), 0};
    ZSTD_compressStream2(context, &out, &in, ZSTD_e_continue);
  }
  ZSTD_inBuffer end{nullptr, 0, 0};
  EXPECT_EQ(ZSTD_compressStream2(context, &out, &end, ZSTD_e_end), 0u);
  ZSTD_freeCCtx(context);
  packed.resize(out.pos);
  EXPECT_EQ(ZSTD_getFrameContentSize(packed.data(), packed.size()), ZSTD_CONTENTSIZE_UNKNOWN);
  return packed;
}

Buffer zstdInTwoFrames(const Buffer& bytes) {
  const auto half = bytes.begin() + static_cast<long>(bytes.size() / 2);
  Buffer packed = zstdInOneGo({bytes.begin(), half});
  const Buffer rest = zstdInOneGo({half, bytes.end()});
  packed.insert(packed.end(), rest.begin(), rest.end());
  return packed;
}

Buffer lz4(const Buffer& bytes) {
  Buffer packed(LZ4F_compressFrameBound(bytes.size(), nullptr));
  packed.resize(
      LZ4F_compressFrame(packed.data(), packed.size(), bytes.data(), bytes.size(), nullptr));
  return packed;
}

Buffer records() {
  Buffer bytes;
  for (std::uint32_t i = 0; i < kMessages; ++i) {
    Buffer data(1000);
    for (std::size_t k = 0; k < data.size(); ++k) data[k] = static_cast<std::uint8_t>(i * k >> 3U);
    putMessage(bytes, {1, i, i, i, data});
  }
  return bytes;
}

struct Packing {
  const char* name;
  const char* compression;
  Buffer (*pack)(const Buffer&);
};

class PackedChunks : public testing::TestWithParam<Packing> {
 protected:
  PackedChunks()
      : file_(fs::path(testing::TempDir()) / (std::string("packing-") + GetParam().name + ".mcap")),
        records_(records()),
        packed_(GetParam().pack(records_)) {}
  ~PackedChunks() override { fs::remove(file_); }

  void write(const Buffer& packed, std::uint64_t size) {
    Buffer bytes(kMagic.begin(), kMagic.end()), chunk;
    putRecord(bytes, Schema{1, "a", "omgidl", "struct a {};"});
    putRecord(bytes, Channel{1, 1, "perdure/ego/imu", "cdr"});
    Put put(chunk);
    put(std::uint64_t{0});
    put(std::uint64_t{kMessages - 1});
    put(size);
    put(crc(records_));
    put(GetParam().compression);
    put(std::uint64_t{packed.size()});
    put.bytes(packed);
    Put(bytes).record(Op::kChunk, chunk);
    std::ofstream(file_, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()),
               static_cast<std::streamsize>(bytes.size()));
  }
  /// Returns the number of messages, or the error. Without an index, the reader checks chunks when
  /// it opens the file, and leaves out a damaged chunk.
  Result<std::uint32_t> read() {
    const auto reader = Reader::open(file_);
    if (!reader) return tl::unexpected(reader.error());
    if (reader->chunks().size() != 1) return fail("no_chunk");
    const auto unpacked = reader->unpack(reader->chunks()[0]);
    if (!unpacked) return tl::unexpected(unpacked.error());
    std::uint32_t next = 0;
    Catalogue other;
    forEachMessage(
        **unpacked, [&](const Message& m, std::uint64_t) { next += m.sequence == next ? 1 : 0; },
        other);
    return next;
  }

  fs::path file_;
  Buffer records_, packed_;
};

TEST_P(PackedChunks, AreReadWhole) {
  write(packed_, records_.size());
  const auto messages = read();
  ASSERT_TRUE(messages) << messages.error().detail;
  EXPECT_EQ(*messages, kMessages);
}

TEST_P(PackedChunks, ThatAreCutOrLieAboutTheirSizeAreDamaged) {
  const std::size_t most = records_.size();
  for (const std::size_t cut : {std::size_t{0}, std::size_t{1}, packed_.size() / 2}) {
    write({packed_.begin(), packed_.begin() + static_cast<long>(cut)}, most);
    EXPECT_FALSE(read()) << cut;
  }
  for (const std::size_t size : {most - 1, most + 1, std::size_t{60u << 20}}) {
    write(packed_, size);
    EXPECT_FALSE(read()) << size;
  }
}

TEST_P(PackedChunks, WithChangedBytesAreDamagedOrRight) {
  int damaged = 0;
  for (std::size_t at = 0; at < packed_.size(); at += packed_.size() / 97) {
    Buffer changed = packed_;
    changed[at] ^= 0x15;
    write(changed, records_.size());
    const auto messages = read();
    EXPECT_EQ(messages.value_or(kMessages), kMessages) << at;
    damaged += messages ? 0 : 1;
  }
  EXPECT_GT(damaged, 80);
}

INSTANTIATE_TEST_SUITE_P(Ways, PackedChunks,
                         testing::Values(Packing{"ZstdInOneGo", "zstd", zstdInOneGo},
                                         Packing{"ZstdAsItGoes", "zstd", zstdAsItGoes},
                                         Packing{"ZstdInTwoFrames", "zstd", zstdInTwoFrames},
                                         Packing{"Lz4", "lz4", lz4}),
                         [](const auto& one) { return std::string(one.param.name); });

TEST(Unpacking, ManyEmptyFramesCostLittle) {
  const auto often = [](const Buffer& frame) {
    Buffer frames;
    for (int i = 0; i < 300'000; ++i) frames.insert(frames.end(), frame.begin(), frame.end());
    return frames;
  };
  const Buffer zstd = often(zstdInOneGo({})), lz4s = often(lz4({}));
  const auto before = std::chrono::steady_clock::now();
  EXPECT_TRUE(unpackedZstd(zstd, 1u << 20).empty());
  EXPECT_TRUE(unpackedLz4(lz4s, 1u << 20).empty());
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - before;
  EXPECT_LT(took.count(), 3.0) << "a megabyte for each frame";
}

TEST(Unpacking, AStreamWithMoreThanWasAskedForIsNotTakenForWhole) {
  const Buffer bytes(5u << 20, 7);
  for (const Buffer& unpacked :
       {unpackedZstd(zstdInOneGo(bytes), 2u << 20), unpackedLz4(lz4(bytes), 2u << 20)}) {
    EXPECT_EQ(unpacked.size(), 3u << 20);
  }
}

TEST(Unpacking, StopsAtWhatIsAskedFor) {
  const Buffer bytes(100u << 20, 7);
  for (const Buffer& unpacked :
       {unpackedZstd(zstdInOneGo(bytes), 1u << 20), unpackedLz4(lz4(bytes), 1u << 20)}) {
    EXPECT_GE(unpacked.size(), 1u << 20);
    EXPECT_LE(unpacked.size(), 2u << 20);
  }
}

}  // namespace
}  // namespace perdure::replay::mcap
