// Parses the texts of IIO's sysfs files.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <string_view>

namespace perdure::capture {

/// Removes surrounding white space; sysfs files end in a newline.
std::string trimmed(std::string_view text);

/// Clock of a device's stamps. kElsewhere: a clock that the host cannot read.
enum class StampClock { kBoot, kMonotonic, kRealtime, kElsewhere };

StampClock stampClockNamed(std::string_view text);

/// Parses a mount matrix, "1, 0, 0; 0, 1, 0; 0, 0, 1", row by row. Empty if the text is not a
/// matrix.
std::optional<Eigen::Matrix3d> parseMount(std::string text);

}  // namespace perdure::capture
