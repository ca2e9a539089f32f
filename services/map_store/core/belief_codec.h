// Converts beliefs to bytes with a version, and back, without loss: a double keeps its bits.
#pragma once

#include <cstdint>
#include <span>

#include "common/base/result.h"
#include "common/types/objects.h"
#include "services/map_store/core/byte_io.h"

namespace perdure::map_store {

/// The version, in the first two bytes of every blob. Readers refuse unknown versions. Version 1
/// has no ledger; version 2 has no pose error in the header.
inline constexpr std::uint16_t kBeliefFormat = 4;

Bytes encodeBelief(const ObjectBelief& belief);
/// Fails with "belief_malformed" if the bytes are truncated, too long, of an unknown version, or
/// have no class.
Result<ObjectBelief> decodeBelief(std::span<const std::uint8_t> bytes);

/// Encodes all members of `objects` except the beliefs. decodeHeader() fails with
/// "belief_malformed".
Bytes encodeHeader(const Objects& objects);
Result<Objects> decodeHeader(std::span<const std::uint8_t> bytes);

}  // namespace perdure::map_store
