// Detects messages at which Cyclone 0.10.2 aborts: an @appendable struct that ends before a member
// that is itself an @appendable struct (cyclonedds#1560, fixed in later versions). Internal to
// common/wire.
#pragma once

#include <cstdint>
#include <span>

namespace perdure::wire {

/// Returns whether the message contains all required structs. `cdr` is XCDR2 accepted by
/// dds_stream_normalize_data(), without encapsulation; `ops` describe its type. Also returns false
/// if the type has members of kinds that Perdure's types do not use.
bool structsArePresent(std::span<const std::uint8_t> cdr, const std::uint32_t* ops);

}  // namespace perdure::wire
