// Start in motion from images and samples. The gyro bias is estimated from epipolar normals,
// the path from the same planes (motion_path.h), then all of them jointly (motion_refinement.h).
#pragma once

#include <deque>
#include <optional>
#include <vector>

#include "services/vio/core/estimator.h"
#include "services/vio/core/propagation/imu_propagator.h"

namespace perdure::vio {

class MotionInitialiser {
 public:
  explicit MotionInitialiser(const Options& options) : options_(options) {}

  /// Adds a frame. A new window begins if its time is not later than that of the last frame.
  void add(const FrameInput& input, TimePoint imu_time);
  void clear() { frames_.clear(), failed_.reset(); }
  /// Returns a start at the newest frame. After a failed search it returns the same failure until
  /// the window has grown by a tenth. Fails with "start_window_short", "start_few_tracks",
  /// "start_no_parallax", "start_force_not_gravity", "start_unobservable" or "start_inconsistent".
  Result<Start> start(const ImuBuffer& imu, const std::vector<CameraModel>& cameras);

 private:
  struct Seen {
    TimePoint time;  ///< IMU clock
    TrackedFrame tracked;
  };
  /// Uses the frames from number `first` on.
  Result<Start> attempt(const ImuBuffer& imu, const std::vector<CameraModel>& cameras,
                        std::size_t first) const;

  Options options_;
  std::deque<Seen> frames_;
  std::optional<Reason> failed_;  ///< the reason, if the last search failed
  TimePoint next_attempt_{};
};

}  // namespace perdure::vio
