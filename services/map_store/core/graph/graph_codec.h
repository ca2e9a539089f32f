// Converts the pose graph to bytes and back, versioned, little-endian and exact.
#pragma once

#include <cstdint>
#include <span>

#include "common/base/result.h"
#include "common/mapping/frames/relative_error.h"  // Matrix6d, for saved_map.h
#include "common/mapping/saved_map.h"
#include "services/map_store/core/byte_io.h"

namespace perdure::map_store {

/// The first two bytes of every blob. A reader refuses unknown versions.
inline constexpr std::uint16_t kGraphFormat = 1;

/// Whether the value is sound: finite numbers, rotations of length 1, all required ids, PMFs within
/// bounds, and no anchor before its `previous`. Unsound values are neither written nor read.
bool isSound(const mapping::LevelPose& pose);
bool isSound(const mapping::Anchor& anchor);
bool isSound(const mapping::Edge& edge);
bool isSound(const mapping::ObjectRecord& record);
bool isSound(const mapping::View& view);

// The decoders refuse ("graph_malformed") bytes that are truncated, too long, of another version or
// unsound.

Bytes encodeAnchor(const mapping::Anchor& anchor);
Result<mapping::Anchor> decodeAnchor(std::span<const std::uint8_t> bytes);

Bytes encodeEdge(const mapping::Edge& edge);
Result<mapping::Edge> decodeEdge(std::span<const std::uint8_t> bytes);

/// `confirmed` and `gone` are not stored; `confirmed` is true after decoding.
Bytes encodeRecord(const mapping::ObjectRecord& record);
Result<mapping::ObjectRecord> decodeRecord(std::span<const std::uint8_t> bytes);

/// Exact, because positions and deviations are stored as floats.
Bytes encodeView(const mapping::View& view);
Result<mapping::View> decodeView(std::span<const std::uint8_t> bytes);

}  // namespace perdure::map_store
