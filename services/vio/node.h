// vio's node: inertial samples, speed and frames in; odometry and landmarks out. Waits until a
// frame's time is covered by inertial samples, pairs stereo frames, starts, resets, resumes.
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
#include "services/vio/core/agreement.h"
#include "services/vio/core/start/initialiser.h"
#include "services/vio/core/start/motion_initialiser.h"
#include "services/vio/core/start/speed_history.h"
#include "services/vio/in_vain.h"
#include "services/vio/speed_doubt.h"
#include "services/vio/waiting_frames.h"

namespace perdure::vio {

struct Outputs {
  Sink<Odometry> odometry;    ///< one for each frame of the first camera, in order
  Sink<Landmarks> landmarks;  ///< after its odometry, once there is a start
  /// After its odometry: how the image met the predictions. For who judges a calibration.
  Sink<std::vector<Innovation>> innovations = {};
};

inline constexpr int kDegradedFrames = 20;  ///< after a gap or a resumption

class Node {
 public:
  Node(const Config& config, InstanceId instance, Outputs outputs);
  ~Node();

  void onCalibration(const Calibration& calibration);
  void onImu(const ImuSample& sample);
  void onSpeed(const SpeedSample& sample);
  void onFrame(const Frame& frame);
  /// What the object filter says of things that move; of use where input.moving_mask is on.
  void onObjects(const Objects& objects) { moving_.onObjects(objects); }
  /// End of data: processes what still waits, with the last inertial sample held.
  void flush();

  /// Names the frame of reference; before the first output.
  void setWorld(WorldId world) { world_ = world; }
  /// Text for restoreState of another process; empty before there is a start.
  std::string saveState() const;
  /// Resumes at the next frame, if that is not too far away. Fails with "state_malformed" or
  /// "state_other_cameras".
  Result<void> restoreState(const std::string& text);

  const ReasonCounts& reasons() const;
  bool started() const;
  HealthState health() const;
  /// One sentence: what it waits for, or what is wrong; empty when all is well.
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
  void noteGaps(TimePoint now);
  void judgeImages(const FrameEstimate& estimate);
  void lose(const Reason& reason);
  void publish(const FrameStamp& stamp, const FrameEstimate& estimate);
  void publishWaiting(const FrameStamp& stamp);
  void publishLandmarks(const FrameStamp& stamp, const cv::Mat& image);
  TimePoint imuTime(TimePoint image_time) const;
  double longestReadout() const;

  Config config_;
  InstanceId instance_;
  Outputs outputs_;
  WorldId world_;
  std::optional<Calibration> calibration_;
  std::unique_ptr<Cameras> cameras_;
  ImuBuffer imu_;
  SpeedHistory speeds_;
  WaitingFrames waiting_;
  MovingMask moving_;
  InVain in_vain_;
  Agreement agreement_;  ///< over starts: a rig that is wrong loses them
  SpeedDoubt speed_doubt_;
  MotionInitialiser motion_initialiser_;
  std::optional<SavedState> saved_;
  std::optional<TimePoint> last_image_, last_imu_time_;
  std::optional<std::uint64_t> last_sequence_;  ///< of the last output with a pose
  std::uint64_t frame_ = 0;
  int degraded_frames_ = 0, unaided_frames_ = 0;
  std::string last_start_reason_;
  OdometryState last_state_ = OdometryState::kInitialising;
  mutable ReasonCounts all_reasons_;
  ReasonCounts reasons_;
};

}  // namespace perdure::vio
