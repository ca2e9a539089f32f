// Reads trajectories: TUM lines (t x y z qx qy qz qw, body in world) and KITTI lines of 12 or 16
// numbers (row-major, one per frame, body of frame k in body of frame 0).
#pragma once

#include <filesystem>
#include <optional>
#include <string_view>
#include <vector>

#include "common/base/ids.h"
#include "common/base/time.h"
#include "common/math/rigid_transform.h"
#include "common/types/odometry.h"

namespace perdure::replay {

enum class PoseFormat { kTum, kKitti };

struct StampedPose {
  TimePoint time;
  RigidTransform T_WB;
};

class PoseFile {
  static constexpr Duration kMaxGap = std::chrono::milliseconds(500);

 public:
  /// Throws StartupError(kData) that names each wrong line. Errors are a wrong count of numbers, a
  /// quaternion whose norm is not 1 (to 1e-2), a rotation matrix that is not orthonormal (to 1e-2),
  /// and times that do not increase.
  /// Lines that begin with '#' are comments, and a first line without numbers is a header. Either
  /// may name the columns if they have another order, are eight of a larger number (poseColumnsOf),
  /// or contain covariances of the steps (files/pose_steps.h). Names of angles are refused. The
  /// message ends with `fix` if the file cannot be read.
  static PoseFile read(const std::filesystem::path& file, std::string_view fix = kFix);
  /// `steps` is empty, or has for each pose the covariance of the step to it (files/pose_steps.h).
  PoseFile(PoseFormat format, std::vector<StampedPose> poses, std::vector<Matrix6d> steps = {});

  PoseFormat format() const { return format_; }
  /// KITTI poses have no times; theirs are 0.
  const std::vector<StampedPose>& poses() const { return poses_; }

  /// Returns the pose of a frame. TUM poses are interpolated at `time` between neighbours at most
  /// `max_gap` apart; a pose within 1 ms is used as it is. KITTI poses are found by the frame's
  /// index. Returns nothing outside the trajectory.
  std::optional<RigidTransform> at(std::uint64_t frame, TimePoint time,
                                   Duration max_gap = kMaxGap) const;
  bool hasSteps() const { return !steps_.empty(); }
  /// Covariance of the error [θ, p] (Odometry) that the steps between two frames add. Both frames
  /// must have a pose, and hasSteps() must be true.
  Matrix6d errorOfSteps(const FrameStamp& before, const FrameStamp& now) const;

 private:
  /// A place on the trajectory: pose `index`, plus the share of the step after it.
  struct Place {
    std::size_t index = 0;
    double share = 0.0;
  };
  std::optional<Place> placeOf(std::uint64_t frame, TimePoint time,
                               Duration max_gap = kMaxGap) const;
  std::optional<Place> placeAtTime(TimePoint time, Duration max_gap) const;
  static constexpr std::string_view kFix = "--odometry takes `vio`, `truth` or a file of poses";
  PoseFormat format_;
  std::vector<StampedPose> poses_;
  std::vector<Matrix6d> steps_;
};

}  // namespace perdure::replay
