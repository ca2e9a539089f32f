// Trajectories in files: TUM lines (t x y z qx qy qz qw, body in world) and KITTI lines of 12 or
// 16 numbers (row-major, one a frame, body of frame k in body of frame 0).
#pragma once

#include <filesystem>
#include <optional>
#include <string_view>
#include <vector>

#include "common/base/time.h"
#include "common/math/rigid_transform.h"

namespace perdure::replay {

enum class PoseFormat { kTum, kKitti };

struct StampedPose {
  TimePoint time;
  RigidTransform T_WB;
};

class PoseFile {
 public:
  /// Throws StartupError(kData) that names each wrong line: a wrong count of numbers, a
  /// quaternion whose norm is not 1 (to 1e-2), a rotation matrix that is not orthonormal (to
  /// 1e-2), times that do not increase. Lines that begin with '#' are comments, a first line
  /// without numbers is a header; either may name the columns in another order, or eight of more
  /// (poseColumnsOf); names of angles are refused. `mend`: what to do where it cannot be read.
  static PoseFile read(const std::filesystem::path& file, std::string_view mend = kMend);
  PoseFile(PoseFormat format, std::vector<StampedPose> poses);

  PoseFormat format() const { return format_; }
  /// KITTI poses have no time: theirs is 0.
  const std::vector<StampedPose>& poses() const { return poses_; }

  /// TUM: by time, interpolated between neighbours that are at most `max_gap` apart; a pose
  /// within 1 ms is taken as it is. KITTI: by the frame's index. Nothing outside.
  std::optional<RigidTransform> at(std::uint64_t frame, TimePoint time,
                                   Duration max_gap = std::chrono::milliseconds(500)) const;

 private:
  std::optional<RigidTransform> atTime(TimePoint time, Duration max_gap) const;
  static constexpr std::string_view kMend = "--odometry takes `vio`, `truth` or a file of poses";
  PoseFormat format_;
  std::vector<StampedPose> poses_;
};

}  // namespace perdure::replay
