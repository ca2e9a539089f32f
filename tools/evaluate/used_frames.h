// Which frames of the data a run was over: those that --every, --from and --seconds leave out are
// no misses. The pipeline keeps it in report.json.
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

/// `frames` of report.json: their number, and [first, last, step] of each run of them.
nlohmann::ordered_json framesToJson(const UsedFrames& frames);
/// Of RUN/report.json; nothing where it is not there or does not tell. Throws StartupError where it
/// tells what cannot be.
std::optional<UsedFrames> usedFramesOf(const std::filesystem::path& run);
/// Frames of the data from one used one to the next; 1 where there are fewer than two.
double strideOf(const UsedFrames& frames);

/// Frames between the first pose and the last one at whose times there is none. Where nobody tells
/// which frames the run was over, they are misses, or --every has left them out.
std::size_t withoutPose(const std::vector<TimePoint>& frames,
                        const std::vector<replay::StampedPose>& poses);

/// The line that says so.
std::string noteOfUntold(std::size_t frames);

/// Takes those out that were not used; their number.
template <class Value>
std::size_t leaveOut(std::map<std::uint64_t, Value>& frames,
                     const std::optional<UsedFrames>& used) {
  if (!used) return 0;
  return std::erase_if(frames, [&](const auto& frame) { return !used->contains(frame.first); });
}

}  // namespace perdure::tools
