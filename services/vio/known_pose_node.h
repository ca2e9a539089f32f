// Node of vio with given poses (`input.odometry: given`). It waits for the pose of each frame,
// pairs stereo frames and publishes landmarks.
#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <string>

#include "common/base/sink.h"
#include "common/types/health.h"
#include "common/types/odometry.h"
#include "common/types/sensors.h"
#include "services/vio/cameras.h"
#include "services/vio/config.h"
#include "services/vio/core/known_poses/point_mapper.h"
#include "services/vio/doubts.h"
#include "services/vio/moving_mask.h"
#include "services/vio/waiting_frames.h"

namespace perdure::vio {

class KnownPoseNode {
 public:
  /// `landmarks` receives one message for each frame of the first camera that has a pose, in order.
  KnownPoseNode(const Config& config, InstanceId instance, Sink<Landmarks> landmarks);

  void onCalibration(const Calibration& calibration);
  /// Takes poses in order of their stamps. Only poses of the first camera's frames are used.
  void onOdometry(const Odometry& odometry);
  void onFrame(const Frame& frame);
  void onObjects(const Objects& objects) { moving_.onObjects(objects); }
  /// End of data: frames that wait for a second image are processed without it.
  void flush() { drain(true); }

  /// Returns the sequence number of the oldest waiting frame; nothing if no frame waits.
  std::optional<std::uint64_t> waitsFor() const;

  const ReasonCounts& reasons() const;
  HealthState health() const;
  /// Returns a sentence that names the missing input or the problem; empty if there is no problem.
  std::string status() const;
  /// Returns a sentence if the poses contradict the images; otherwise an empty string.
  std::string statusOfPoses() const;

 private:
  struct Cameras {
    Cameras(const Config& config, std::vector<CameraModel> all)
        : models(std::move(all)),
          tracker(config.tracker, models),
          mapper(config.core.vision, config.core.window, extrinsics(models), readouts(models)) {}

    std::vector<CameraModel> models;
    Tracker tracker;
    PointMapper mapper;
  };
  void judgePoses();
  void drain(bool all);
  bool isBefore(TimePoint time, const std::optional<TimePoint>& newest) const;
  void clockJumpedBack();
  void giveUp(const Reason& reason, const char* why);
  const Odometry* poseOf(const Frame& frame) const;
  void process(const FramePair& frames, const Odometry& odometry);
  void begin(const WorldId& world);

  Config config_;
  InstanceId instance_;
  Sink<Landmarks> landmarks_;
  MovingMask moving_;
  std::optional<Calibration> calibration_;
  std::unique_ptr<Cameras> cameras_;
  WaitingFrames waiting_;
  std::deque<Odometry> poses_;    ///< oldest first; their frames may still arrive
  std::optional<Odometry> last_;  ///< odometry of the last image that was used
  std::optional<TimePoint> last_image_;
  std::optional<TimePoint> newest_frame_;  ///< newest frame received
  Agreement agreement_;
  InVain other_size_;
  InVain in_vain_;  ///< frames without landmarks
  mutable ReasonCounts all_reasons_;
  ReasonCounts reasons_;
};

}  // namespace perdure::vio
