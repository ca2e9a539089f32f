// What recordings pack their chunks with.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace perdure::replay {

/// What there is of a bz2 stream, of LZ4 frames or of zstd frames, `most` bytes and a step at most:
/// a stream that is damaged or cut gives what came before. Memory is asked for by what comes, not
/// by what a file says; frames need not tell their size (who packs as it goes cannot).
std::vector<std::uint8_t> unpackedBz2(std::span<const std::uint8_t> packed, std::uint64_t most);
std::vector<std::uint8_t> unpackedLz4(std::span<const std::uint8_t> packed, std::uint64_t most);
std::vector<std::uint8_t> unpackedZstd(std::span<const std::uint8_t> packed, std::uint64_t most);

/// Whether it begins as a frame of zstd does.
bool isZstd(std::span<const std::uint8_t> bytes);
/// One frame; nothing where it is damaged, cut or larger than `most`.
std::optional<std::vector<std::uint8_t>> wholeOfZstd(std::span<const std::uint8_t> packed,
                                                     std::uint64_t most);

}  // namespace perdure::replay
