// Beliefs as bytes, for the database: versioned, little-endian, exact (a double keeps its bits).
#pragma once

#include <cstdint>
#include <span>

#include "common/base/result.h"
#include "common/types/objects.h"
#include "services/map_store/core/byte_io.h"

namespace perdure::map_store {

/// The first two bytes of every blob. A reader refuses versions that it does not know. 1 has no
/// ledger, 2 no pose error in the header.
inline constexpr std::uint16_t kBeliefFormat = 3;

Bytes encodeBelief(const ObjectBelief& belief);
/// Refuses ("belief_malformed") what is cut short, too long, of another version or without class.
Result<ObjectBelief> decodeBelief(std::span<const std::uint8_t> bytes);

/// All of `objects` but its beliefs.
Bytes encodeHeader(const Objects& objects);
Result<Objects> decodeHeader(std::span<const std::uint8_t> bytes);

}  // namespace perdure::map_store
