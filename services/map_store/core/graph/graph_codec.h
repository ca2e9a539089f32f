// Converts parts of the pose graph to little-endian bytes with a version, and back, without loss.
#pragma once

#include <cstdint>
#include <span>

#include "common/base/result.h"
#include "common/mapping/frames/relative_error.h"  // Matrix6d, for saved_map.h
#include "common/mapping/saved_map.h"
#include "services/map_store/core/byte_io.h"

namespace perdure::map_store {

/// The version, in the first two bytes of every blob. Readers refuse unknown versions.
inline constexpr std::uint16_t kGraphFormat = 1;

/// Whether a value is sound: its numbers are finite, quaternions have length 1, required ids are
/// present, PMFs are within bounds, and an anchor's id is above that of its `previous`. Unsound
/// values are neither written nor read.
bool isSound(const mapping::LevelPose& pose);
bool isSound(const mapping::Anchor& anchor);
bool isSound(const mapping::Edge& edge);
bool isSound(const mapping::ObjectRecord& record);
bool isSound(const mapping::View& view);

// The decoders fail with "graph_malformed" if the bytes are truncated, too long, of an unknown
// version, or unsound.

Bytes encodeAnchor(const mapping::Anchor& anchor);
Result<mapping::Anchor> decodeAnchor(std::span<const std::uint8_t> bytes);

Bytes encodeEdge(const mapping::Edge& edge);
Result<mapping::Edge> decodeEdge(std::span<const std::uint8_t> bytes);

/// `confirmed` and `gone` are not stored; `confirmed` is true after decoding.
Bytes encodeRecord(const mapping::ObjectRecord& record);
Result<mapping::ObjectRecord> decodeRecord(std::span<const std::uint8_t> bytes);

/// Encodes a view without loss, because its positions and deviations are floats in memory too.
Bytes encodeView(const mapping::View& view);
Result<mapping::View> decodeView(std::span<const std::uint8_t> bytes);

}  // namespace perdure::map_store
