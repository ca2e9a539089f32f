// The files of a folder as parts of one recording. Internal to common/replay.
#pragma once

#include <cstdint>
#include <filesystem>
#include <set>
#include <string>
#include <vector>

namespace perdure::replay {

struct RecordingPart {
  std::filesystem::path file;
  std::uint64_t start_ns = 0, end_ns = 0;  ///< recording times of the first and last message
  std::set<std::string> topics;            ///< topics with messages
};

/// Returns a sentence for each gap between two parts. Throws StartupError if two files contain the
/// same topics at the same time, because they are two recordings, which would be mixed.
std::vector<std::string> joinParts(std::vector<RecordingPart> parts);

}  // namespace perdure::replay
