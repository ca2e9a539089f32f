#include "common/replay/recordings/unpack.h"

#include <bzlib.h>
#include <lz4frame.h>
#include <zstd.h>

#include <algorithm>
#include <array>
#include <memory>

namespace perdure::replay {
namespace {

/// Collects decompressed data in steps. Unused capacity is retained between calls, so that a stream
/// of empty frames does not allocate one step per frame.
class Unpacked {
 public:
  explicit Unpacked(std::uint64_t most)
      : most_(most), step_(most < kStep ? static_cast<std::size_t>(most) + 1 : kStep) {}
  /// Returns whether there is room for more data. One byte beyond the limit is allowed, so that a
  /// longer stream is detected.
  bool wantsMore() const { return used_ <= most_; }
  std::uint8_t* room() {
    if (used_ == bytes_.size()) bytes_.resize(used_ + step_);
    return bytes_.data() + used_;
  }
  std::size_t roomSize() const { return bytes_.size() - used_; }
  void came(std::size_t n) { used_ += n; }
  std::vector<std::uint8_t> take() {
    bytes_.resize(used_);
    return std::move(bytes_);
  }

 private:
  static constexpr std::size_t kStep = 1u << 20;
  std::uint64_t most_;
  std::size_t step_;  ///< small limits use small steps, because such calls are frequent
  std::size_t used_ = 0;
  std::vector<std::uint8_t> bytes_;
};

}  // namespace

std::vector<std::uint8_t> unpackedBz2(std::span<const std::uint8_t> packed, std::uint64_t most) {
  Unpacked unpacked(most);
  bz_stream stream{};
  if (BZ2_bzDecompressInit(&stream, 0, 0) != BZ_OK) return {};
  // The library does not write to its input, although its interface has no const.
  stream.next_in = reinterpret_cast<char*>(const_cast<std::uint8_t*>(packed.data()));
  stream.avail_in = static_cast<unsigned int>(packed.size());
  int state = BZ_OK;
  while (state == BZ_OK && unpacked.wantsMore()) {
    stream.next_out = reinterpret_cast<char*>(unpacked.room());
    const std::size_t room = unpacked.roomSize();
    stream.avail_out = static_cast<unsigned int>(room);
    state = BZ2_bzDecompress(&stream);
    const std::size_t written = room - stream.avail_out;
    unpacked.came(written);
    if (written == 0) break;  // end of the stream
  }
  BZ2_bzDecompressEnd(&stream);
  return unpacked.take();
}

std::vector<std::uint8_t> unpackedLz4(std::span<const std::uint8_t> packed, std::uint64_t most) {
  Unpacked unpacked(most);
  LZ4F_dctx* context = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&context, LZ4F_VERSION)) != 0) return {};
  while (!packed.empty() && unpacked.wantsMore()) {
    std::uint8_t* room = unpacked.room();
    std::size_t written = unpacked.roomSize(), read = packed.size();
    const std::size_t state =
        LZ4F_decompress(context, room, &written, packed.data(), &read, nullptr);
    if (LZ4F_isError(state) != 0 || (written == 0 && read == 0)) break;
    unpacked.came(written);
    packed = packed.subspan(read);
  }
  LZ4F_freeDecompressionContext(context);
  return unpacked.take();
}

std::vector<std::uint8_t> unpackedZstd(std::span<const std::uint8_t> packed, std::uint64_t most) {
  static thread_local const std::unique_ptr<ZSTD_DCtx, decltype(&ZSTD_freeDCtx)> context(
      ZSTD_createDCtx(), &ZSTD_freeDCtx);
  ZSTD_DCtx_reset(context.get(), ZSTD_reset_session_only);
  Unpacked unpacked(most);
  ZSTD_inBuffer in{packed.data(), packed.size(), 0};
  while (unpacked.wantsMore()) {
    std::uint8_t* room = unpacked.room();
    ZSTD_outBuffer out{room, unpacked.roomSize(), 0};
    const std::size_t read = in.pos;
    const std::size_t state = ZSTD_decompressStream(context.get(), &out, &in);
    if (ZSTD_isError(state) != 0 || (out.pos == 0 && in.pos == read)) break;
    unpacked.came(out.pos);
    if (state == 0 && in.pos == in.size) break;
  }
  return unpacked.take();
}

bool isZstd(std::span<const std::uint8_t> bytes) {
  static constexpr std::array<std::uint8_t, 4> kMagic = {0x28, 0xB5, 0x2F, 0xFD};
  return bytes.size() > kMagic.size() && std::equal(kMagic.begin(), kMagic.end(), bytes.begin());
}

std::optional<std::vector<std::uint8_t>> wholeOfZstd(std::span<const std::uint8_t> packed,
                                                     std::uint64_t most) {
  const auto stated = ZSTD_getFrameContentSize(packed.data(), packed.size());
  const bool unknown = stated == ZSTD_CONTENTSIZE_UNKNOWN;
  if (stated == ZSTD_CONTENTSIZE_ERROR || (!unknown && stated > most)) return std::nullopt;
  auto bytes = unpackedZstd(packed, unknown ? most : stated);
  if (unknown ? bytes.empty() || bytes.size() > most : bytes.size() != stated) return std::nullopt;
  return bytes;
}

}  // namespace perdure::replay
