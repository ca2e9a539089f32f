// What ROS' messages are called and how their definitions read, made of the structs' own fields.
#pragma once

#include <string>

#include "common/ros/messages.h"

namespace perdure::ros {

/// "sensor_msgs/Image" → "sensor_msgs/msg/Image".
std::string ros2Name(const std::string& type);
/// "sensor_msgs/msg/Image" → "sensor_msgs/Image"; ROS 1's names stay.
std::string plainName(const std::string& name);

/// The message's definition with those of all that it is made of, as rosbag2 writes it (`ros2msg`).
/// M: one of the messages that have a topic of their own.
template <class M>
std::string definitionOf();

}  // namespace perdure::ros
