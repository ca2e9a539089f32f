// Keeps the last seconds as packed chunks in memory, to be written after a fault.
#pragma once

#include <deque>

#include "tools/record/segment_writer.h"

namespace perdure::tools {

class BlackBox {
 public:
  /// Keeps at least `seconds`, limited by `most_bytes`.
  BlackBox(double seconds, std::uint64_t most_bytes);

  void add(PackedChunk chunk);
  /// Returns all chunks, the oldest first, and empties the box.
  std::deque<PackedChunk> take();

  double seconds() const;
  std::uint64_t bytes() const { return bytes_; }
  /// Number of chunks that were dropped early because memory was insufficient.
  std::uint64_t cutShort() const { return cut_short_; }

 private:
  void dropOldest();

  const std::int64_t longest_ns_;
  const std::uint64_t most_bytes_;
  std::deque<PackedChunk> chunks_;
  std::uint64_t bytes_ = 0, cut_short_ = 0;
};

}  // namespace perdure::tools
