// The vehicle's calibration out of what drivers say: CameraInfo of each camera, /tf_static between
// their frames; a rig file goes before both.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/ros/messages.h"
#include "common/ros/sensors.h"
#include "common/types/sensors.h"

namespace perdure::ros2 {

/// What the rig is made for.
struct RigCamera {
  std::string name;        ///< Perdure's
  std::string info_topic;  ///< for sentences
  bool rectified = false;  ///< its images are
};

class Rig {
 public:
  /// `body`: the body's frame; empty: the IMU's, without one the odometry's child, without both
  /// that of the first camera.
  Rig(std::vector<RigCamera> cameras, Calibration given, bool has_imu, bool has_odometry,
      std::string body);

  void onTransforms(const ros::TFMessage& message);
  /// Reasons: lens, not_finite, uncalibrated (infos that cannot be used).
  Result<void> onInfo(std::size_t camera, const ros::CameraInfo& info);
  void onImageOf(std::size_t camera, const std::string& frame_id, TimePoint time);
  void onImuOf(const std::string& frame_id);
  void onOdometryOf(const std::string& child_frame_id);

  /// Once all is known; again whenever it changed. Without source.
  std::optional<Calibration> news();
  /// What is known in full.
  const std::optional<Calibration>& complete() const { return told_; }
  /// What it still waits for, with the mend; empty where nothing is missing.
  std::string missing() const;
  /// The body in the odometry's child; nothing where no way between the two is known.
  std::optional<RigidTransform> bodyIn(const std::string& child_frame_id) const;

 private:
  struct Camera {
    RigCamera is;
    std::optional<ros::CameraInfo> info = {};
    std::optional<CameraCalibration> lens = {};
    std::string frame_id = {};
    std::vector<double> intervals = {};  ///< s, of the first images
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
