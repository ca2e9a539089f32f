// Decompression of chunks in recordings.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace perdure::replay {

/// Decompresses a bz2 stream, LZ4 frames or zstd frames, up to `most` bytes plus one step. A
/// damaged or truncated stream gives the data before the error. Memory is allocated for
/// decompressed data, not for sizes stated in the file. Frames need no stated size, because
/// streaming compressors do not write it.
std::vector<std::uint8_t> unpackedBz2(std::span<const std::uint8_t> packed, std::uint64_t most);
std::vector<std::uint8_t> unpackedLz4(std::span<const std::uint8_t> packed, std::uint64_t most);
std::vector<std::uint8_t> unpackedZstd(std::span<const std::uint8_t> packed, std::uint64_t most);

/// Returns whether the bytes begin with a zstd frame.
bool isZstd(std::span<const std::uint8_t> bytes);
/// Decompresses one frame. Returns nothing if it is damaged, truncated or larger than `most`.
std::optional<std::vector<std::uint8_t>> wholeOfZstd(std::span<const std::uint8_t> packed,
                                                     std::uint64_t most);

}  // namespace perdure::replay
