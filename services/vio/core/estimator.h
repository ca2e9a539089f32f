// The filter over tracked points. For each image it propagates and clones the state, updates it,
// marginalises, and returns the pose of the body (paper, eq. 3 and 5). It does not access images,
// threads or clocks.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "common/base/result.h"
#include "common/types/odometry.h"
#include "services/vio/core/propagation/imu_buffer.h"
#include "services/vio/core/state/options.h"
#include "services/vio/core/state/saved_state.h"
#include "services/vio/core/state/state.h"
#include "services/vio/core/tracks/tracks.h"
#include "services/vio/core/update/mount_monitor.h"
#include "services/vio/core/update/point_updates.h"
#include "services/vio/core/update/standstill.h"

namespace perdure::vio {

struct Start {
  TimePoint time;
  Nav nav;
  Eigen::Matrix<double, 15, 15> covariance = Eigen::Matrix<double, 15, 15>::Identity();
  bool at_rest = false;
};

struct SpeedReading {
  double speed = 0.0, sigma = 0.1;  ///< m/s, body x
};

struct FrameInput {
  std::uint64_t frame = 0;  ///< increases from frame to frame
  TimePoint image_time;
  TrackedFrame tracked;
  std::optional<double> motion_px;  ///< median image motion over the last frames
  std::optional<SpeedReading> speed;
  std::optional<double> most_motion_px = {};  ///< 0.8 quantile of the points' image motion
  double still_share = 0.0;                   ///< share of points that have not moved for a second
};

struct FrameEstimate {
  Nav nav;
  Matrix9d covariance = Matrix9d::Zero();  ///< [θ, p, v]
  bool has_increment = false;
  std::uint64_t increment_from = 0;
  Matrix6d transition = Matrix6d::Identity(), increment_covariance = Matrix6d::Zero();
  bool at_rest = false;
  /// True if the gate refused the speed; empty if there was no speed.
  std::optional<bool> speed_refused;
  int points_used = 0;                  ///< points of this image used by all updates
  int points_refused = 0;               ///< points that the gate or the triangulation refused
  std::vector<Innovation> innovations;  ///< filled after keepInnovations()
};

class Estimator {
 public:
  /// T_BC has one or two cameras. readout_s is the read-out time of each camera, 0 for a global
  /// shutter; empty if all are global.
  Estimator(const Options& options, const std::vector<RigidTransform>& T_BC, double time_offset_s,
            const std::vector<double>& readout_s = {});

  /// Initialises the state from `start`, with an empty window. A running filter is reset.
  void start(const Start& start);
  /// Initialises the state from a saved state, for which fits() must succeed.
  void restore(const SavedState& saved);
  /// Checks that a saved state has the cameras, shutters and estimated quantities of this filter.
  /// Fails with state_other_cameras, state_other_shutter or state_other_estimates.
  Result<void> fits(const SavedState& saved) const;
  /// Returns the state for restore(); the caller sets world and next_track. Call it only if
  /// started().
  SavedState save() const;
  bool started() const { return state_.has_value(); }
  void stop() { state_.reset(); }
  /// After this call, estimates carry the innovations of the state's points.
  void keepInnovations() { keeps_innovations_ = true; }

  /// Propagates with the samples of `imu` to the frame and updates the state. Fails with
  /// "frame_not_after_state", "imu_missing" or "numbers_…". In the last case the estimator is
  /// stopped.
  Result<FrameEstimate> process(const FrameInput& input, const ImuBuffer& imu);

  /// Returns the gyroscope's rotation R_B1_B0 of the body between two IMU times. Before a start,
  /// the gyroscope's bias is assumed to be zero. Returns the identity without samples, or if `to`
  /// is not later.
  Eigen::Matrix3d predictRotation(const ImuBuffer& imu, TimePoint from, TimePoint to);

  /// Returns the rotation vector, in B, of the body while the first camera reads out an image of
  /// the IMU time `time`. Before a start, the gyroscope's bias is assumed to be zero. Returns zero
  /// for a global shutter.
  Eigen::Vector3d turnOfReadout(const ImuBuffer& imu, TimePoint time);

  /// Returns the cameras of `calibrated` with all estimates: lens, pose on the body, time offset,
  /// read-out. Before a start they are as calibrated.
  std::vector<CameraModel> cameras(const std::vector<CameraModel>& calibrated) const;

  /// Returns the angle, in rad, by which the cameras last turned on the body; nothing if no turn
  /// was found. Later starts use the cameras' new pose.
  std::optional<double> mountTurn() const { return mount_.turn(); }

  /// Returns the points of the newest image whose position is known, without descriptors.
  std::vector<Landmark> landmarks() const;

  const State& state() const { return *state_; }
  State& state() { return *state_; }
  const Options& options() const { return options_; }
  const ReasonCounts& reasons() const { return reasons_; }

 private:
  Result<void> propagateTo(const FrameInput& input, const ImuBuffer& imu);
  bool restUpdate(const FrameInput& input, const ImuBuffer& imu, TimePoint from);
  bool medianRests(const FrameInput& input) const;
  bool standsInTraffic(const ImuBuffer& imu, bool background_rests);
  bool velocityMayBeZero() const;
  Result<void> visionUpdate(const FrameInput& input, FrameEstimate& out);
  std::vector<const Track*> onceUsed(std::uint64_t frame, bool window_full) const;
  void forgetUsed(const std::vector<const Track*>& used, std::uint64_t frame);
  Result<void> admitPoints(std::uint64_t frame, bool window_full);
  void dropEarlierImages(std::uint64_t newest);
  void dropLostPoints(std::uint64_t frame);
  void widenBySupposedDepth();
  void report(const FrameInput& input, FrameEstimate& out);
  void marginalise(bool at_rest);
  void measureRows(const ImuBuffer& imu);
  Result<void> sane() const;
  Landmark ofState(const PointState& point, const ImagePoint& seen) const;
  std::optional<Landmark> ofTrack(const Track& track, const ImagePoint& seen) const;

  Options options_;
  std::vector<RigidTransform> T_BC_;
  double time_offset_s_;
  std::vector<double> readout_s_;
  bool keeps_innovations_ = false;
  std::optional<State> state_;
  Standstill standstill_;
  MountMonitor mount_;
  FeatureDatabase database_;
  TrackedFrame newest_;
  /// Readings of one interval; a member so that its memory is reused.
  std::vector<ImuReading> readings_;
  std::vector<ImuReading> rows_;  ///< readings around one image; its memory is reused too
  ReasonCounts reasons_;
  bool agreed_ = false;      ///< most points of the last image agreed with their predictions
  double supposed_m_ = 0.0;  ///< m of path along which most points had the scene's depth
  std::optional<std::uint64_t> previous_frame_;
  Matrix6d previous_pose_covariance_ = Matrix6d::Zero();
};

}  // namespace perdure::vio
