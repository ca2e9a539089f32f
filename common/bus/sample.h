// Access to received messages without copying them, in shared memory or in Cyclone's buffers.
// Internal to common/bus.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "common/bus/domain.h"

namespace perdure::bus {

inline constexpr std::size_t kBatch = 64;  ///< messages taken at once

struct RawSample {
  std::span<const std::uint8_t> cdr;  ///< CDR without header, in native byte order
  bool in_shared_memory = false;
  std::shared_ptr<const void> keeper;  ///< owns the memory of `cdr` and keeps the reader
};

/// Takes at most `most` samples. The result is empty if no sample is available.
std::vector<RawSample> takeInPlace(const std::shared_ptr<const Entity>& reader, std::size_t most);

}  // namespace perdure::bus
