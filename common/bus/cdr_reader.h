// Reads the messages of a topic in serialised form, for recorders.
#pragma once

#include <cstdint>
#include <functional>
#include <span>

#include "common/bus/endpoint.h"

namespace perdure::bus {

struct CdrMessage {
  std::span<const std::uint8_t> bytes;  ///< as in common/wire/cdr.h; valid during the call
  std::int64_t written_ns = 0;          ///< time of writing on the writer's system clock
};

class CdrReader : public RawReader {
 public:
  using Handler = std::function<void(const CdrMessage&)>;

  CdrReader(const Participant& participant, const std::string& topic)
      : RawReader(participant, topic) {}

  /// Passes at most one batch to the handler, in order. Returns true if more messages may be
  /// available. Disposals are not reported.
  bool drainBatch(const Handler& handler);
};

}  // namespace perdure::bus
