// Assigns the columns of a pose table by the names in its header.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace perdure::replay {

struct PoseColumns {
  std::array<std::size_t, 8> of{};  ///< column indices of t x y z qx qy qz qw
  std::size_t count = 0;            ///< number of all columns
  bool nanoseconds = false;  ///< times are in nanoseconds, as in EuRoC and `rostopic echo -p`
};

/// Finds the columns if each of the eight quantities has exactly one name (x, tx, p_RS_R_x [m],
/// field.pose.position.x; qx, q_RS_x [], orientation.x; t, timestamp, header.stamp). Otherwise
/// returns nothing.
std::optional<PoseColumns> poseColumnsOf(const std::vector<std::string_view>& names);

/// Returns true if the names contain angles (roll, pitch, yaw) and no quaternion.
bool namesAngles(const std::vector<std::string_view>& names);

/// Returns the kind and the fix ("this is JSON …") if a line shows that the file is not a table of
/// poses. Otherwise returns "".
std::string otherKindOfPoses(std::string_view line, const std::vector<std::string_view>& fields);

}  // namespace perdure::replay
