// Detects faults, and stores the last seconds as packed chunks, which are written after a fault.
#pragma once

#include <chrono>
#include <deque>
#include <map>
#include <optional>
#include <string>

#include "common/types/health.h"
#include "tools/record/segment_writer.h"

namespace perdure::tools {

class BlackBox {
 public:
  /// Stores the last `seconds` or more, or less if they exceed `most_bytes`.
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

/// Detects faults: a process that reports one, or a process that became silent.
class FaultWatch {
 public:
  using Time = std::chrono::steady_clock::time_point;

  /// `from`: the mildest state that is a fault, kFailed or kDegraded.
  explicit FaultWatch(HealthState from = HealthState::kFailed) : from_(from) {}

  /// Returns a description if the message shows a process's transition to a fault.
  std::optional<std::string> onHealth(const Health& health, Time now);
  /// Returns a description if `silent`, the number of `health` writers that missed their lease, has
  /// increased. An orderly shutdown removes the writer, so it does not count.
  std::optional<std::string> onSilent(std::size_t silent, Time now);

 private:
  struct Process {
    HealthState state = HealthState::kStarting;
    Time heard{};
  };
  const HealthState from_;
  std::map<std::string, Process> processes_;
  std::size_t silent_ = 0;
};

}  // namespace perdure::tools
