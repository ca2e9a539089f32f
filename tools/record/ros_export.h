// `perdure record export --ros2`: converts a recording to ROS 2, for viewers and for `ros2 bag
// play`.
#pragma once

#include <filesystem>

#include "common/base/result.h"

namespace perdure::tools {

/// Writes MCAP with profile ros2; the topics are those of common/ros/mirror.h. Counts messages that
/// cannot be read. Throws StartupError.
ReasonCounts exportRos2(const std::filesystem::path& from, const std::filesystem::path& to);

}  // namespace perdure::tools
