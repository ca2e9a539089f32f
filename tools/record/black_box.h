// The last seconds, packed, in memory: written down when something went wrong.
#pragma once

#include <deque>

#include "tools/record/segment_writer.h"

namespace perdure::tools {

class BlackBox {
 public:
  /// At least `seconds`, as far as `most_bytes` suffice.
  BlackBox(double seconds, std::uint64_t most_bytes);

  void add(PackedChunk chunk);
  /// Hands over all that is held, the oldest first.
  std::deque<PackedChunk> take();

  double seconds() const;
  std::uint64_t bytes() const { return bytes_; }
  /// Chunks that had to go before their time, because memory was short.
  std::uint64_t cutShort() const { return cut_short_; }

 private:
  void dropOldest();

  const std::int64_t longest_ns_;
  const std::uint64_t most_bytes_;
  std::deque<PackedChunk> chunks_;
  std::uint64_t bytes_ = 0, cut_short_ = 0;
};

}  // namespace perdure::tools
