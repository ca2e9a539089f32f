// Detects messages at which Cyclone 0.10.2 aborts: an @appendable struct that ends before a member
// that is itself one (cyclonedds#1560).
#pragma once

#include <cstdint>
#include <span>

namespace perdure::wire {

/// Whether the message (XCDR2 accepted by dds_stream_normalize_data(), without encapsulation)
/// contains all required structs; `ops` describe its type.
bool structsArePresent(std::span<const std::uint8_t> cdr, const std::uint32_t* ops);

}  // namespace perdure::wire
