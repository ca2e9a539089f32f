// Reads the covariances of the steps between poses: columns step_A_B beside the pose, by the names
// in a header.
#pragma once

#include <optional>
#include <utility>

#include "common/replay/files/text_file.h"
#include "common/types/odometry.h"

namespace perdure::replay {

/// A step is the motion from the pose of the previous line. Its error (r, x) is defined by T = T̂
/// (Exp(r), x), along the axes of the body at the line's pose: x y z in metres, rx ry rz in
/// radians. A and B are two of these six; entries that have no column are 0.
class PoseSteps {
 public:
  /// Removes the fields of the step from `fields`, which belong to a header or to a line below it.
  /// Returns false if it adds an error to `wrong`: a misspelt name, an entry that is given twice, a
  /// missing variance, a line with another number of columns, or a matrix that is not positive
  /// semi-definite. A header below the first pose is an error, too.
  bool take(const TextLine& line, bool comment, bool after_poses,
            std::vector<std::string_view>& fields, Complaints& wrong);

  /// Covariances [θ, p] of all lines so far; empty if no header names a step.
  std::vector<Matrix6d> covariances;

 private:
  /// Row and column; nothing for a column of the pose.
  using Entry = std::optional<std::pair<int, int>>;
  std::string entriesOf(const std::vector<std::string_view>& names);
  /// Removes the step's fields; returns true.
  bool withoutSteps(std::vector<std::string_view>& fields) const;
  std::string addCovariance(const std::vector<std::string_view>& fields);
  std::vector<Entry> entries_;  ///< entries of the covariance, in the order of the file's columns
};

}  // namespace perdure::replay
