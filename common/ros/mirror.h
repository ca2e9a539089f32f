// Perdure's topics as those of ROS 2: one message of Perdure in, all messages of ROS that it makes
// out, encoded. What a message needs besides (calibration, classes, where the odometry lies in the
// map, the newest rate of turn) is kept of those before.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/ros/messages.h"
#include "common/types/detections.h"
#include "common/types/health.h"
#include "common/types/map.h"
#include "common/types/objects.h"
#include "common/types/odometry.h"
#include "common/types/sensors.h"

namespace perdure::ros {

/// A topic of ROS 2 that is written.
struct Outlet {
  std::string topic;       ///< "/perdure/objects"
  std::string type;        ///< "vision_msgs/Detection3DArray"
  bool latched = false;    ///< TRANSIENT_LOCAL; all are RELIABLE
  std::string definition;  ///< ros2msg
};

class Mirror {
 public:
  using Out = std::function<void(const Outlet& outlet, std::vector<std::uint8_t> cdr)>;
  /// Whether somebody reads it. What nobody reads is not made, unless it is latched.
  using Wanted = std::function<bool(const Outlet& outlet)>;
  /// `prefix` stands before all topics but /tf and /tf_static. Without `wanted` all is.
  Mirror(std::string prefix, Out out, Wanted wanted = {})
      : prefix_(std::move(prefix)), out_(std::move(out)), wanted_(std::move(wanted)) {}

  /// Objects go as Autoware's TrackedObjects to this topic besides; empty: they do not.
  void sayTrackedObjects(const std::string& topic) { tracked_objects_ = topic; }

  /// All that may be written of a vehicle with these cameras, for those who tell beforehand.
  std::vector<Outlet> outlets(const std::vector<std::string>& cameras) const;

  void onCalibration(const Calibration& calibration);  ///< tf_static, camera_info
  void onFrame(const Frame& frame);  ///< image_raw or image_raw/compressed, camera_info
  void onImage(const Frame& frame);  ///< the same without camera_info
  std::string imageTopic(const std::string& camera) const {  ///< image_raw
    return prefix_ + "/" + camera + "/image_raw";
  }
  void onImu(const ImuSample& sample);
  void onOdometry(const perdure::Odometry& odometry);  ///< odometry, tf
  void onLandmarks(const Landmarks& landmarks);
  void onModel(const ModelInfo& model);
  void onDetections(const Detections& detections);
  void onMapFrame(const MapFrame& frame) { map_frame_ = frame; }
  void onObjects(const Objects& objects);  ///< objects, markers, Autoware's
  /// Diagnostics, at the newest time that was heard of.
  void onHealth(const Health& health);

 private:
  /// `make()` gives the message, and is called where somebody wants it.
  template <class Make>
  void say(const std::string& topic, Make make, bool latched = false);
  template <class M>
  Outlet outletOf(const std::string& topic, bool latched = false) const;
  void sayInfo(const CameraCalibration& camera, TimePoint time);
  RigidTransform inMap(const WorldId& world) const;

  std::string prefix_, tracked_objects_;
  Out out_;
  Wanted wanted_;
  std::map<std::string, Outlet> outlets_;
  std::optional<Calibration> calibration_;
  std::map<std::uint64_t, ModelInfo> models_;
  std::optional<MapFrame> map_frame_;
  std::optional<Eigen::Vector3d> gyro_;
  TimePoint newest_;
};

}  // namespace perdure::ros
