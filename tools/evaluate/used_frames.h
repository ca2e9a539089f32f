// The frames that a run used, from report.json. Frames that the run skipped do not count as misses.
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

/// Returns `frames` of report.json: their number, and [first, last, step] of each regular series.
nlohmann::ordered_json framesToJson(const UsedFrames& frames);
/// Reads RUN/report.json; empty if the file is missing or has no frames. Throws StartupError if its
/// frames are invalid.
std::optional<UsedFrames> usedFramesOf(const std::filesystem::path& run);
/// Mean step of the frame index between used frames; 1 if there are fewer than two.
double strideOf(const UsedFrames& frames);

/// Number of frames without a pose between the first pose and the last one. If it is unknown which
/// frames the run used, these are misses or frames that --every skipped.
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
