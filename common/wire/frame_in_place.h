// A Frame as it lies in CDR, without copying its pixels. Internal to common/wire.
#pragma once

#include <cstdint>
#include <span>

#include "common/wire/description/types.h"

namespace perdure::wire {

/// Fills `wire`, whose camera and pixels then point into `cdr`: native byte order, no header, XCDR1
/// or XCDR2 (the same for this type, whose members of 8 bytes come first). False where it is cut
/// off or the text does not end.
bool frameInPlace(std::span<const std::uint8_t> cdr, perdure_msg_Frame& wire);

/// Bytes of `wire` as CDR without its header.
std::size_t sizeInPlace(const perdure_msg_Frame& wire);

}  // namespace perdure::wire
