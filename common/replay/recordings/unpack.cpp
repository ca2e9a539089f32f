#include "common/replay/recordings/unpack.h"

#include <bzlib.h>
#include <lz4frame.h>
#include <zstd.h>

#include <memory>

namespace perdure::replay {
namespace {

constexpr std::size_t kStep = 1u << 20;

}  // namespace

std::vector<std::uint8_t> unpackedBz2(std::span<const std::uint8_t> packed, std::uint64_t most) {
  std::vector<std::uint8_t> bytes;
  bz_stream stream{};
  if (BZ2_bzDecompressInit(&stream, 0, 0) != BZ_OK) return bytes;
  // The library does not write there; its interface is older than const.
  stream.next_in = reinterpret_cast<char*>(const_cast<std::uint8_t*>(packed.data()));
  stream.avail_in = static_cast<unsigned int>(packed.size());
  int state = BZ_OK;
  while (state == BZ_OK && bytes.size() < most) {
    const std::size_t before = bytes.size();
    bytes.resize(before + kStep);
    stream.next_out = reinterpret_cast<char*>(bytes.data() + before);
    stream.avail_out = kStep;
    state = BZ2_bzDecompress(&stream);
    bytes.resize(before + kStep - stream.avail_out);
    if (bytes.size() == before) break;  // nothing more comes
  }
  BZ2_bzDecompressEnd(&stream);
  return bytes;
}

std::vector<std::uint8_t> unpackedLz4(std::span<const std::uint8_t> packed, std::uint64_t most) {
  std::vector<std::uint8_t> bytes;
  LZ4F_dctx* context = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&context, LZ4F_VERSION)) != 0) return bytes;
  while (!packed.empty() && bytes.size() < most) {
    const std::size_t before = bytes.size();
    bytes.resize(before + kStep);
    std::size_t written = kStep, read = packed.size();
    const std::size_t state =
        LZ4F_decompress(context, bytes.data() + before, &written, packed.data(), &read, nullptr);
    const bool damaged = LZ4F_isError(state) != 0;
    bytes.resize(before + (damaged ? 0 : written));
    if (damaged || (written == 0 && read == 0)) break;
    packed = packed.subspan(read);
  }
  LZ4F_freeDecompressionContext(context);
  return bytes;
}

std::vector<std::uint8_t> unpackedZstd(std::span<const std::uint8_t> packed, std::uint64_t most) {
  static thread_local const std::unique_ptr<ZSTD_DCtx, decltype(&ZSTD_freeDCtx)> context(
      ZSTD_createDCtx(), &ZSTD_freeDCtx);
  ZSTD_DCtx_reset(context.get(), ZSTD_reset_session_only);
  std::vector<std::uint8_t> bytes;
  ZSTD_inBuffer in{packed.data(), packed.size(), 0};
  while (bytes.size() < most) {
    const std::size_t before = bytes.size();
    bytes.resize(before + kStep);
    ZSTD_outBuffer out{bytes.data() + before, kStep, 0};
    const std::size_t read = in.pos;
    const std::size_t state = ZSTD_decompressStream(context.get(), &out, &in);
    const bool damaged = ZSTD_isError(state) != 0;
    bytes.resize(before + (damaged ? 0 : out.pos));
    if (damaged || (out.pos == 0 && in.pos == read)) break;
    if (state == 0 && in.pos == in.size) break;
  }
  return bytes;
}

}  // namespace perdure::replay
