// Reads a Frame from CDR without copying its pixels. Internal to common/wire.
#pragma once

#include <cstdint>
#include <span>

#include "idl/sensors.h"

namespace perdure::wire {

/// Fills `wire`, whose camera and pixels then refer to `cdr`. `cdr` has native byte order and no
/// header, in XCDR1 or XCDR2, which are identical for this type because its members of 8 bytes come
/// first. Returns false if the data are truncated, or if the text has no terminator.
bool frameInPlace(std::span<const std::uint8_t> cdr, perdure_msg_Frame& wire);

/// Returns the size in bytes of `wire` as CDR without a header.
std::size_t sizeInPlace(const perdure_msg_Frame& wire);

}  // namespace perdure::wire
