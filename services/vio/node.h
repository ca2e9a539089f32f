// Node of vio. It receives inertial samples, speed and frames, and publishes odometry and
// landmarks.
#pragma once

#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/base/sink.h"
#include "common/types/health.h"
#include "common/types/odometry.h"
#include "common/types/sensors.h"
#include "services/vio/cameras.h"
#include "services/vio/config.h"
#include "services/vio/core/known_poses/point_mapper.h"
#include "services/vio/core/start/initialiser.h"
#include "services/vio/core/start/motion_initialiser.h"
#include "services/vio/core/start/speed_history.h"
#include "services/vio/doubts.h"
#include "services/vio/waiting_frames.h"

namespace perdure::vio {

struct Outputs {
  Sink<Odometry> odometry;    ///< one for each frame of the first camera, in order
  Sink<Landmarks> landmarks;  ///< sent after the odometry, once the filter has started
  /// Sent after the odometry: innovations of the image, for programs that check a calibration.
  Sink<std::vector<Innovation>> innovations = {};
  /// Sent before the odometry if estimates of the cameras differ from those sent before.
  Sink<Calibration> calibration = {};
};

inline constexpr int kDegradedFrames = 20;  ///< number of degraded frames after a gap or a restart

class Node {
 public:
  Node(const Config& config, InstanceId instance, Outputs outputs);

  void onCalibration(const Calibration& calibration);
  void onImu(const ImuSample& sample);
  void onSpeed(const SpeedSample& sample);
  void onFrame(const Frame& frame);
  void onObjects(const Objects& objects) { moving_.onObjects(objects); }
  /// Processes the waiting frames at the end of the data. The last inertial sample is repeated up
  /// to them.
  void flush() { drain(true); }

  /// Sets the frame of reference. Call it before the first output.
  void setWorld(WorldId world) { world_ = world; }
  /// Returns the text for restoreState() in another process; empty before a start.
  std::string saveState() const;
  /// Continues from the saved state at the next frame, unless the state is too old. Fails with
  /// "state_malformed" or "state_other_cameras".
  Result<void> restoreState(const std::string& text);

  const ReasonCounts& reasons() const;
  bool started() const { return cameras_ && cameras_->estimator.started(); }
  HealthState health() const;
  /// Returns a sentence that names the missing input or the problem; empty if there is no problem.
  std::string status() const;

 private:
  void clockJumpedBack();
  void drain(bool all);
  bool ready() const;
  bool waitsForPair() const;
  std::string whyAlone() const;
  void process(const FramePair& frames);
  TrackedFrame trackImages(const cv::Mat& first, const cv::Mat& second, TimePoint now);
  void begin(TimePoint now, const FrameInput& input);
  Result<Start> startWithoutSpeed(TimePoint now);
  std::size_t framesIn(double seconds) const;
  bool resume(TimePoint now);
  TimePoint timeBefore(TimePoint now) const;
  void noteGaps(TimePoint now);
  void judgeImages(const FrameEstimate& estimate);
  void lose(const Reason& reason);
  void publish(const FrameStamp& stamp, const FrameEstimate& estimate);
  void publishWaiting(const FrameStamp& stamp);
  void publishLandmarks(const FrameStamp& stamp, const cv::Mat& image);
  TimePoint imuTime(TimePoint image_time) const;

  Config config_;
  InstanceId instance_;
  Outputs outputs_;
  WorldId world_;
  std::optional<Calibration> calibration_;
  std::unique_ptr<Cameras> cameras_;
  CameraNews news_;
  ImuBuffer imu_;
  SpeedHistory speeds_;
  WaitingFrames waiting_;
  MovingMask moving_;
  InVain in_vain_;
  Agreement agreement_;  ///< not reset at a start, because a wrong rig causes repeated restarts
  SpeedDoubt speed_doubt_;
  PositionDoubt position_doubt_;
  MotionInitialiser motion_initialiser_;
  std::optional<SavedState> saved_;
  std::optional<TimePoint> last_image_, last_imu_time_;
  std::optional<std::uint64_t> last_sequence_;  ///< sequence of the last output with a pose
  std::uint64_t frame_ = 0;
  int degraded_frames_ = 0, unaided_frames_ = 0;
  bool aided_ = false;  ///< an update has used a point since the start
  std::string last_start_reason_;
  OdometryState last_state_ = OdometryState::kInitialising;
  mutable ReasonCounts all_reasons_;
  ReasonCounts reasons_;
};

}  // namespace perdure::vio
