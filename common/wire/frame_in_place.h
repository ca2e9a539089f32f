// Reads a Frame from CDR without copying its pixels. Internal to common/wire.
#pragma once

#include <cstdint>
#include <span>

#include "idl/sensors.h"

namespace perdure::wire {

/// Fills `wire`; its camera and pixels refer to `cdr`: native byte order, no header, XCDR1 or XCDR2
/// (identical for this type, because its members of 8 bytes come first). Returns false if the data
/// are truncated or the text has no terminator.
bool frameInPlace(std::span<const std::uint8_t> cdr, perdure_msg_Frame& wire);

/// Size of `wire` as CDR without its header.
std::size_t sizeInPlace(const perdure_msg_Frame& wire);

}  // namespace perdure::wire
