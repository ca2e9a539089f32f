// What Cyclone 0.10.2 aborts at: an @appendable struct that ends before a member that is itself an
// @appendable struct (cyclonedds#1560, mended in later versions). Internal to common/wire.
#pragma once

#include <cstdint>
#include <span>

namespace perdure::wire {

/// Whether every struct of the message that must be there is. `cdr` is XCDR2 that
/// dds_stream_normalize_data() has taken, without encapsulation; `ops` describe its type. False
/// also where the type has members of kinds that no type of ours has.
bool structsArePresent(std::span<const std::uint8_t> cdr, const std::uint32_t* ops);

}  // namespace perdure::wire
