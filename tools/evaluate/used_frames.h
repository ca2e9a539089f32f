// The frames that a run used, so that skipped ones are no misses; stored in report.json.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/replay/files/pose_file.h"

namespace perdure::tools {

using UsedFrames = std::set<std::uint64_t>;

/// `frames` of report.json: their number, and [first, last, step] of each run of frames.
nlohmann::ordered_json framesToJson(const UsedFrames& frames);
/// Reads RUN/report.json; empty if it is missing or has no frames. Throws StartupError if the
/// frames are invalid.
std::optional<UsedFrames> usedFramesOf(const std::filesystem::path& run);
/// Number of frames of the data from one used frame to the next; 1 if there are fewer than two.
double strideOf(const UsedFrames& frames);

/// Number of frames without a pose between the first pose and the last one. If the used frames are
/// unknown, these are either misses or frames that --every skipped.
std::size_t withoutPose(const std::vector<TimePoint>& frames,
                        const std::vector<replay::StampedPose>& poses);

std::string noteOfUntold(std::size_t frames);

/// Removes the frames that were not used and returns their number.
template <class Value>
std::size_t leaveOut(std::map<std::uint64_t, Value>& frames,
                     const std::optional<UsedFrames>& used) {
  if (!used) return 0;
  return std::erase_if(frames, [&](const auto& frame) { return !used->contains(frame.first); });
}

}  // namespace perdure::tools
