// The input side of the bridge, without DDS. It converts messages of ROS to messages of Perdure,
// and counts problems, each with its fix. `now_ns` are arrival times on CLOCK_MONOTONIC.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/base/sink.h"
#include "common/types/detections.h"
#include "common/types/health.h"
#include "common/types/odometry.h"
#include "common/types/sensors.h"
#include "services/ros2/config.h"
#include "services/ros2/core/boxes.h"
#include "services/ros2/core/clocks.h"
#include "services/ros2/core/pose_track.h"
#include "services/ros2/core/rig.h"
#include "services/ros2/core/stereo.h"
#include "services/ros2/core/troubles.h"

namespace perdure::ros2 {

struct Outputs {
  Sink<Frame> frame = {};
  Sink<ImuSample> imu = {};
  Sink<Calibration> calibration = {};
  Sink<Odometry> odometry = {};
  Sink<Detections> detections = {};
  Sink<ModelInfo> model = {};
};

class Node {
 public:
  /// `rig`: calibration from the file in.rig; empty if no file is configured.
  Node(const Config& config, Calibration rig, InstanceId instance, Outputs outputs);

  void start();

  // Messages of ROS. `camera`: index in Config::cameras().
  void onImage(std::size_t camera, const ros::Image& image, std::int64_t now_ns);
  void onImage(std::size_t camera, const ros::CompressedImage& image, std::int64_t now_ns);
  void onInfo(std::size_t camera, const ros::CameraInfo& info, std::int64_t now_ns);
  void onTransforms(const ros::TFMessage& message);
  void onImu(const ros::Imu& imu, std::int64_t now_ns);
  void onOdometry(const ros::Odometry& odometry, std::int64_t now_ns);
  void onDetections(const ros::Detection2DArray& detections, std::int64_t now_ns);
  /// Counts a message whose bytes do not match its type.
  void onMalformed(const std::string& input, const Reason& reason, std::int64_t now_ns) {
    troubles_.add(input, reason, now_ns);
  }

  /// Takes a frame of Perdure's capture. Call it only if the cameras are not those of ROS.
  void onOwnFrame(const Frame& frame, std::int64_t now_ns);

  const Troubles& troubles() const { return troubles_; }
  std::pair<HealthState, std::string> health(std::int64_t now_ns) const;

 private:
  void takeImage(std::size_t camera, const ros::Header& header, Result<Frame> frame,
                 std::int64_t now_ns);
  void giveFrame(std::size_t camera, Frame frame, TimePoint ros_stamp, std::int64_t now_ns);
  bool fits(std::size_t camera, const Frame& frame, std::int64_t now_ns);
  int bitsOf(std::size_t camera, const ros::Image& image);
  void tellRig();
  void tellPoses(std::int64_t now_ns);
  void giveDetections(const ros::Detection2DArray& detections, const FrameStamp& stamp,
                      std::int64_t now_ns);
  void noteFrame(TimePoint ros_stamp, const FrameStamp& stamp, std::int64_t now_ns);
  std::optional<TimePoint> placed(const std::string& input, const ros::Header& header,
                                  std::int64_t now_ns);

  const Config config_;
  const std::vector<CameraInput> cameras_;
  const InstanceId instance_;
  const Outputs outputs_;
  Troubles troubles_;
  Clocks clocks_;
  Rig rig_;
  Stereo stereo_;
  FrameBook book_;
  PoseTrack poses_;
  ModelInfo model_;
  std::vector<int> bits_;
  std::uint64_t next_frame_ = 0, next_sample_ = 0;
  std::deque<ros::Detection2DArray> early_;
};

}  // namespace perdure::ros2
