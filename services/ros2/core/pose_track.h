// Interpolates odometry of ROS at the times of images.
#pragma once

#include <deque>
#include <optional>
#include <vector>

#include "common/base/result.h"
#include "common/ros/messages.h"
#include "common/types/odometry.h"

namespace perdure::ros2 {

struct PoseTrackOptions {
  /// Standard deviations (m, rad) for axes whose covariance is not in the message.
  double sigma_position = 0.05, sigma_rotation = 0.01;
  double jump_m = 3.0;
};

class PoseTrack {
 public:
  PoseTrack(const PoseTrackOptions& options, WorldId world) : options_(options), world_(world) {}

  /// Adds an odometry message. `T_child_body`: pose of the body in the message's child frame. Fails
  /// with not_finite, no_rotation or covariance. Also fails with jumped after a jump of the pose,
  /// but uses the message, in a new epoch. Decreasing times begin a new epoch too.
  Result<void> onOdometry(const ros::Odometry& message, TimePoint time,
                          const RigidTransform& T_child_body);
  /// Adds a frame that needs a pose. If too many frames wait, drops the oldest and fails with
  /// "late".
  Result<void> onFrame(const FrameStamp& stamp);
  /// Returns the poses that can be interpolated now, in order of the frames. Frames before the
  /// first message, or in a gap of half a second, receive no pose; `untold` counts them.
  std::vector<Odometry> take();
  std::uint64_t untold() const { return untold_; }

 private:
  struct Knot {
    TimePoint time;
    WorldId world;
    Odometry odometry;
  };
  std::optional<Odometry> at(TimePoint time) const;

  PoseTrackOptions options_;
  WorldId world_;
  std::deque<Knot> knots_;
  std::deque<FrameStamp> frames_;
  std::uint64_t untold_ = 0;
};

}  // namespace perdure::ros2
