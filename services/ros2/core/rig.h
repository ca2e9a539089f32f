// Builds the calibration from CameraInfo and /tf_static. A rig file takes precedence over both.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/ros/messages.h"
#include "common/ros/sensors.h"
#include "common/types/sensors.h"

namespace perdure::ros2 {

struct RigCamera {
  std::string name;        ///< name in Perdure
  std::string info_topic;  ///< topic of CameraInfo, for messages to the user
  bool rectified = false;  ///< its images are rectified
};

class Rig {
 public:
  /// `body`: frame of the body. If empty, the frame of the IMU is used, otherwise the odometry's
  /// child frame, otherwise the frame of the first camera.
  Rig(std::vector<RigCamera> cameras, Calibration given, bool has_imu, bool has_odometry,
      std::string body);

  void onTransforms(const ros::TFMessage& message);
  /// Adds a CameraInfo. Fails with lens, not_finite or uncalibrated if it cannot be used.
  Result<void> onInfo(std::size_t camera, const ros::CameraInfo& info);
  void onImageOf(std::size_t camera, const std::string& frame_id, TimePoint time);
  void onImuOf(const std::string& frame_id);
  void onOdometryOf(const std::string& child_frame_id);

  /// Returns the calibration once it is complete, and again after each change; otherwise nothing.
  /// Its source is not set.
  std::optional<Calibration> news();
  const std::optional<Calibration>& complete() const { return told_; }
  /// Returns the missing inputs, with the fix; empty if none are missing.
  std::string missing() const;
  /// Returns the pose of the body in the odometry's child frame, if the transform between the two
  /// is known.
  std::optional<RigidTransform> bodyIn(const std::string& child_frame_id) const;

 private:
  struct Camera {
    RigCamera is;
    std::optional<ros::CameraInfo> info = {};
    std::optional<CameraCalibration> lens = {};
    std::string frame_id = {};
    std::vector<double> intervals = {};  ///< s, between the first images
    std::optional<TimePoint> last = {};
  };
  std::string body() const;
  std::string missingOf(const Camera& camera) const;
  std::optional<CameraCalibration> calibrationOf(const Camera& camera) const;

  std::vector<Camera> cameras_;
  const Calibration given_;
  const bool has_imu_, has_odometry_;
  const std::string body_;
  std::string imu_frame_, child_frame_;
  ros::FrameTree tree_;
  bool changed_ = true;
  std::optional<Calibration> told_;
};

}  // namespace perdure::ros2
