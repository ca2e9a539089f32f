// Odometry of ROS at the times of images: poses between two messages.
#pragma once

#include <deque>
#include <optional>
#include <vector>

#include "common/base/result.h"
#include "common/ros/messages.h"
#include "common/types/odometry.h"

namespace perdure::ros2 {

struct PoseTrackOptions {
  double sigma_position = 0.05, sigma_rotation = 0.01;  ///< where messages say none; m, rad
  double jump_m = 3.0;
};

class PoseTrack {
 public:
  PoseTrack(const PoseTrackOptions& options, WorldId world) : options_(options), world_(world) {}

  /// `T_child_body`: the body in the message's child. Reasons: not_finite, no_rotation, covariance,
  /// jumped (it is taken, in a new epoch). Times that go back begin a new epoch, too.
  Result<void> onOdometry(const ros::Odometry& message, TimePoint time,
                          const RigidTransform& T_child_body);
  /// A frame whose pose is wanted. Reason: frames_waiting (too many wait; the oldest is let go).
  Result<void> onFrame(const FrameStamp& stamp);
  /// The poses of frames that can be told now, in order of the frames. Frames before the first
  /// message, or in a gap of half a second, get none; `untold` counts them.
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
