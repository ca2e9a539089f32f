// What IIO says in texts of sysfs, read.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <string_view>

namespace perdure::capture {

/// Without the white space around it: a file of sysfs ends in a newline.
std::string trimmed(std::string_view text);

/// Whose time a device stamps by. kElsewhere: none that the host could be asked for.
enum class StampClock { kBoot, kMonotonic, kRealtime, kElsewhere };

/// Of `current_timestamp_clock`.
StampClock stampClockNamed(std::string_view text);

/// Of a mount matrix, "1, 0, 0; 0, 1, 0; 0, 0, 1", row by row; nothing where it is none.
std::optional<Eigen::Matrix3d> parseMount(std::string text);

}  // namespace perdure::capture
