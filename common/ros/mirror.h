// Publishes Perdure's topics as topics of ROS 2. Data that several messages need are stored:
// calibration, classes, pose of the odometry in the map, and the latest angular rate.
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

struct Outlet {
  std::string topic;       ///< "/perdure/objects"
  std::string type;        ///< "vision_msgs/Detection3DArray"
  bool latched = false;    ///< DURABILITY is TRANSIENT_LOCAL; all topics are RELIABLE
  std::string definition;  ///< text in the format ros2msg
};

class Mirror {
 public:
  using Out = std::function<void(const Outlet& outlet, std::vector<std::uint8_t> cdr)>;
  /// Returns whether a topic has readers. Messages without readers are not created, unless the
  /// topic is latched.
  using Wanted = std::function<bool(const Outlet& outlet)>;
  /// `prefix` precedes all topics except /tf and /tf_static. Without `wanted`, all messages are
  /// created, except obstacles, which are large and follow from the objects.
  Mirror(std::string prefix, Out out, Wanted wanted = {})
      : prefix_(std::move(prefix)), out_(std::move(out)), wanted_(std::move(wanted)) {}

  /// Also publishes objects as Autoware's TrackedObjects on this topic, unless it is empty.
  void sayTrackedObjects(const std::string& topic) { tracked_objects_ = topic; }
  /// Also publishes the time of each odometry message on /clock, for nodes with use_sim_time.
  void sayClock(bool say) { clock_ = say; }

  /// All topics that may be published for a vehicle with these cameras, to declare them in advance.
  std::vector<Outlet> outlets(const std::vector<std::string>& cameras) const;

  void onCalibration(const Calibration& calibration);  ///< publishes tf_static, camera_info
  void onFrame(const Frame& frame);  ///< publishes image_raw or image_raw/compressed, camera_info
  void onImage(const Frame& frame);  ///< publishes images only, without camera_info
  std::string imageTopic(const std::string& camera) const {  ///< topic image_raw
    return prefix_ + "/" + camera + "/image_raw";
  }
  void onImu(const ImuSample& sample);
  void onOdometry(const perdure::Odometry& odometry);  ///< publishes odometry, tf, clock
  void onLandmarks(const Landmarks& landmarks);
  void onModel(const ModelInfo& model);
  void onDetections(const Detections& detections);
  void onMapFrame(const MapFrame& frame) { map_frame_ = frame; }
  void onObjects(
      const Objects& objects);  ///< publishes objects, markers, obstacles, Autoware's objects
  /// Publishes diagnostics with the latest stamp of all messages so far.
  void onHealth(const Health& health);

 private:
  /// Publishes the message that `make()` creates, if the topic is latched or has readers.
  void say(const std::string& topic, auto make, bool latched = false);
  template <class M>
  Outlet outletOf(const std::string& topic, bool latched = false) const;
  void sayInfo(const CameraCalibration& camera, TimePoint time);
  RigidTransform inMap(const WorldId& world) const;

  std::string prefix_, tracked_objects_;
  bool clock_ = false;
  Out out_;
  Wanted wanted_;
  std::map<std::string, Outlet> outlets_;
  std::optional<Calibration> calibration_;
  std::map<std::uint64_t, ModelInfo> models_;
  std::optional<MapFrame> map_frame_;
  std::optional<Imu> imu_;  ///< latest sample
  TimePoint newest_;
};

}  // namespace perdure::ros
