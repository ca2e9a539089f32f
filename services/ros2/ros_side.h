// Where ROS is: a participant, as ROS 2's own middlewares have one, with topics, types and quality
// of service as they expect them.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "common/bus/foreign/endpoints.h"
#include "common/ros/mirror.h"
#include "common/service/service.h"
#include "services/ros2/config.h"

namespace perdure::ros2 {

/// "/camera/image_raw" → "rt/camera/image_raw".
std::string wireTopic(const std::string& topic);
/// "sensor_msgs/Image" → "sensor_msgs::msg::dds_::Image_".
std::string wireType(const std::string& type);

class RosSide {
 public:
  /// On the bus's own domain, or on one of its own. Throws StartupError: a closed bus is no place
  /// for ROS (78), DDS refuses (69).
  RosSide(service::Context& context, const Config& config);

  void advertise(const ros::Outlet& outlet);
  /// Somebody reads it.
  bool wants(const std::string& topic) const;
  void write(const ros::Outlet& outlet, std::vector<std::uint8_t> cdr);
  /// `input` names its counts. Best effort, so that any driver is heard, unless `reliable`.
  void read(const std::string& input, const std::string& topic, const std::string& type,
            bool reliable, bool latched, int depth, bus::ForeignReader::Handler handler);
  /// An input that nobody writes, with the mend; empty where all have a writer.
  std::string unheard() const;

 private:
  struct Input {
    std::string topic, type;
    std::unique_ptr<bus::ForeignReader> reader;
  };
  static bus::Participant participantFor(service::Context& context, const Config& config);

  service::Context& context_;
  const bus::Participant participant_;
  std::map<std::string, std::unique_ptr<bus::ForeignWriter>> writers_;
  std::vector<Input> inputs_;
};

}  // namespace perdure::ros2
