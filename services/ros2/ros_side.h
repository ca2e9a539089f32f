// A DDS participant with the topics, types and quality of service of ROS 2.
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

/// Returns the DDS name of a topic: "/camera/image_raw" gives "rt/camera/image_raw".
std::string wireTopic(const std::string& topic);
/// Returns the DDS name of a type: "sensor_msgs/Image" gives "sensor_msgs::msg::dds_::Image_".
std::string wireType(const std::string& type);

class RosSide {
 public:
  /// Throws StartupError: 78 if a secured bus would include ROS, 69 if DDS fails.
  RosSide(service::Context& context, const Config& config);

  void advertise(const ros::Outlet& outlet);
  bool wants(const std::string& topic) const;
  void write(const ros::Outlet& outlet, std::vector<std::uint8_t> cdr);
  /// Adds a reader. `input`: prefix of its counts. Without `reliable` (best effort), it matches
  /// every driver.
  void read(const std::string& input, const std::string& topic, const std::string& type,
            bool reliable, bool latched, int depth, bus::ForeignReader::Handler handler);
  /// Returns a sentence with the fix if the network has changed or an input has no writer;
  /// otherwise empty.
  std::string trouble() const;

 private:
  struct Input {
    std::string topic, type;
    std::unique_ptr<bus::ForeignReader> reader;
  };
  static bus::Domain domainFor(service::Context& context, const Config& config);

  service::Context& context_;
  const bool all_interfaces_;
  const bus::Domain domain_;
  const bus::Participant participant_;
  std::map<std::string, std::unique_ptr<bus::ForeignWriter>> writers_;
  std::vector<Input> inputs_;
};

}  // namespace perdure::ros2
