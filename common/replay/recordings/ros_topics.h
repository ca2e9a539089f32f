// Selects the topics of the cameras and the inertial unit in a ROS recording: the requested topics,
// otherwise those identified by type and name.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "common/replay/recordings/ros_messages.h"

namespace perdure::replay {

struct CameraTopics {
  std::string image, info;  ///< info: sensor_msgs/CameraInfo; empty if there is none
  bool compressed = false;  ///< sensor_msgs/CompressedImage
  bool rectified = false;   ///< true for names with "image_rect…"
};
struct ChosenTopics {
  std::vector<CameraTopics> cameras;  ///< cam0, and cam1 of a pair
  std::string imu;                    ///< topic of the IMU; empty if the recording has no IMU
};

/// Parses "cam0=/left/image_raw", … into topics by cam0, cam1, imu. Throws StartupError(kUsage)
/// with the fix.
std::map<std::string, std::string> topicsOf(const std::vector<std::string>& assignments);

/// Chooses the topics; `wanted` has the requested ones by cam0, cam1 and imu. Throws StartupError
/// if the choice is ambiguous, or if a requested topic is missing. The message begins with `file`
/// and lists the candidates and the fix.
ChosenTopics chooseTopics(const RosTopics& topics, const std::map<std::string, std::string>& wanted,
                          const std::string& file);

}  // namespace perdure::replay
