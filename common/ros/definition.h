// Names and definitions of ROS messages, generated from the fields of the structs.
#pragma once

#include <string>

#include "common/ros/messages.h"

namespace perdure::ros {

/// Converts "sensor_msgs/Image" to "sensor_msgs/msg/Image".
std::string ros2Name(const std::string& type);
/// Converts "sensor_msgs/msg/Image" to "sensor_msgs/Image"; names of ROS 1 are unchanged.
std::string plainName(const std::string& name);

/// The definition of the message and of the structs in it, in the format of rosbag2 (`ros2msg`).
template <class M>
std::string definitionOf();

}  // namespace perdure::ros
