// The pose graph as bytes, for the database: as beliefs are, versioned, little-endian, exact.
#pragma once

#include <cstdint>
#include <span>

#include "common/base/result.h"
#include "common/mapping/frames/relative_error.h"  // Matrix6d, for saved_map.h
#include "common/mapping/saved_map.h"
#include "services/map_store/core/byte_io.h"

namespace perdure::map_store {

/// The first two bytes of every blob. A reader refuses versions that it does not know.
inline constexpr std::uint16_t kGraphFormat = 1;

/// Finite numbers, rotations of length 1, ids where there must be one, no PMF beyond bounds. What
/// is not sound is neither written nor read. An anchor comes after its `previous`.
bool isSound(const mapping::LevelPose& pose);
bool isSound(const mapping::Anchor& anchor);
bool isSound(const mapping::Edge& edge);
bool isSound(const mapping::ObjectRecord& record);
bool isSound(const mapping::View& view);

// The decoders refuse ("graph_malformed") what is cut short, too long, of another version or not
// sound.

Bytes encodeAnchor(const mapping::Anchor& anchor);
Result<mapping::Anchor> decodeAnchor(std::span<const std::uint8_t> bytes);

Bytes encodeEdge(const mapping::Edge& edge);
Result<mapping::Edge> decodeEdge(std::span<const std::uint8_t> bytes);

/// `confirmed` and `gone` are not kept: the first comes back true.
Bytes encodeRecord(const mapping::ObjectRecord& record);
Result<mapping::ObjectRecord> decodeRecord(std::span<const std::uint8_t> bytes);

/// Exact: places and deviations are floats, as they are kept.
Bytes encodeView(const mapping::View& view);
Result<mapping::View> decodeView(std::span<const std::uint8_t> bytes);

}  // namespace perdure::map_store
