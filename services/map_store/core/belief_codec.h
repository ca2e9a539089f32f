// Converts beliefs to bytes and back, versioned and exact: a double keeps its bits.
#pragma once

#include <cstdint>
#include <span>

#include "common/base/result.h"
#include "common/types/objects.h"
#include "services/map_store/core/byte_io.h"

namespace perdure::map_store {

/// The first two bytes of every blob; readers refuse unknown versions. Version 1 has no ledger;
/// version 2 has no pose error in the header.
inline constexpr std::uint16_t kBeliefFormat = 4;

Bytes encodeBelief(const ObjectBelief& belief);
/// Refuses ("belief_malformed") truncated, too long, classless or unknown-version bytes.
Result<ObjectBelief> decodeBelief(std::span<const std::uint8_t> bytes);

/// Encodes all members of `objects` except the beliefs.
Bytes encodeHeader(const Objects& objects);
Result<Objects> decodeHeader(std::span<const std::uint8_t> bytes);

}  // namespace perdure::map_store
