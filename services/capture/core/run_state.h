// Progress of a run through a drive, from which a restarted capture continues.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace perdure::capture {

struct RunState {
  std::string drive;                ///< digest of folder, pace and rate of the run
  std::string boot;                 ///< boot id; each boot restarts CLOCK_MONOTONIC
  std::int64_t start_ns = 0;        ///< CLOCK_MONOTONIC at which `origin_ns` was due
  std::int64_t origin_ns = 0;       ///< sensor time of the first message
  std::int64_t last_ns = 0;         ///< sensor time of the last message sent
  std::uint64_t next_sequence = 0;  ///< clock mode: number after the last frame sent; follow mode:
                                    ///< first frame without credit
  bool finished = false;
};

std::string toText(const RunState& state);
/// Parses a run state. Returns nothing if the text is truncated or has another format.
std::optional<RunState> runStateFrom(const std::string& text);

}  // namespace perdure::capture
