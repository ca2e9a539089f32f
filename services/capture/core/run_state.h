// Where a run through a drive is: enough for a restarted capture to carry on.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace perdure::capture {

struct RunState {
  std::string drive;           ///< digest of folder, pace and rate: another run is not carried on
  std::string boot;            ///< of the machine: CLOCK_MONOTONIC starts anew with it
  std::int64_t start_ns = 0;   ///< CLOCK_MONOTONIC at which `origin_ns` was due
  std::int64_t origin_ns = 0;  ///< sensor time of the first message
  std::int64_t last_ns = 0;    ///< sensor time of the last message that was given
  std::uint64_t next_sequence = 0;  ///< clock: after the last one given; follow: first not credited
  bool finished = false;
};

std::string toText(const RunState& state);
/// Nothing where the text is not a run state (cut off, another format).
std::optional<RunState> runStateFrom(const std::string& text);

}  // namespace perdure::capture
