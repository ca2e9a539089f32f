// Which topics of a ROS recording are the cameras and the inertial unit: those that were asked for,
// else those that their types and names tell.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "common/replay/recordings/ros_messages.h"

namespace perdure::replay {

struct CameraTopics {
  std::string image, info;  ///< info: of sensor_msgs/CameraInfo; empty where there is none
  bool compressed = false;  ///< sensor_msgs/CompressedImage
  bool rectified = false;   ///< by its name, "image_rect…"
};
struct ChosenTopics {
  std::vector<CameraTopics> cameras;  ///< cam0, and cam1 of a pair
  std::string imu;                    ///< empty where there is none
};

/// "cam0=/left/image_raw", … by cam0, cam1, imu. Throws StartupError(kUsage) with the mend.
std::map<std::string, std::string> topicsOf(const std::vector<std::string>& assignments);

/// `wanted`: topics by cam0, cam1, imu. Where several may be meant, or one that is wanted is not
/// there: throws StartupError with all of the kind and the mend. `file` begins its sentences.
ChosenTopics chooseTopics(const RosTopics& topics, const std::map<std::string, std::string>& wanted,
                          const std::string& file);

}  // namespace perdure::replay
