// A topic's messages as they came, for those who keep them without looking: recorders.
#pragma once

#include <cstdint>
#include <functional>
#include <span>

#include "common/bus/endpoint.h"

namespace perdure::bus {

struct CdrMessage {
  std::span<const std::uint8_t> bytes;  ///< common/wire/cdr.h; valid within the call
  std::int64_t written_ns = 0;          ///< by the writer's system clock
};

class CdrReader : public RawReader {
 public:
  using Handler = std::function<void(const CdrMessage&)>;

  CdrReader(const Participant& participant, const std::string& topic)
      : RawReader(participant, topic) {}

  /// Hands over at most one batch, in its order; true where there may be more. What is disposed is
  /// not told.
  bool drainBatch(const Handler& handler);
};

}  // namespace perdure::bus
