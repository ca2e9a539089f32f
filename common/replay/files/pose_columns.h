// Which columns of a table of poses are which, by the names in its header.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace perdure::replay {

struct PoseColumns {
  std::array<std::size_t, 8> of{};  ///< t x y z qx qy qz qw
  std::size_t count = 0;            ///< of all columns
  bool nanoseconds = false;         ///< as EuRoC's files and `rostopic echo -p` have times
};

/// Where each of the eight has one name (x, tx, p_RS_R_x [m], field.pose.position.x; qx, q_RS_x [],
/// orientation.x; t, timestamp, header.stamp). Nothing where one has none or several.
std::optional<PoseColumns> poseColumnsOf(const std::vector<std::string_view>& names);

/// Names of angles (roll, pitch, yaw) and of no quaternion.
bool namesAngles(const std::vector<std::string_view>& names);

/// "this is JSON …" where a line shows that the file is of a kind that is no table of poses, with
/// the mend; else "".
std::string otherKindOfPoses(std::string_view line, const std::vector<std::string_view>& fields);

}  // namespace perdure::replay
