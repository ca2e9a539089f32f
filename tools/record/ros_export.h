// `perdure record export --ros2`: a recording as one of ROS 2, for viewers and for `ros2 bag play`.
#pragma once

#include <filesystem>

#include "common/base/result.h"

namespace perdure::tools {

/// MCAP, profile ros2; topics are those of common/ros/mirror.h. What cannot be read is counted.
/// Throws StartupError.
ReasonCounts exportRos2(const std::filesystem::path& from, const std::filesystem::path& to);

}  // namespace perdure::tools
