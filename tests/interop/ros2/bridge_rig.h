// Runs perdure-ros2 between a test on Perdure's bus and simulated ROS 2 nodes on Fast DDS.
#pragma once

#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "common/bus/wait_loop.h"
#include "tests/process/support.h"

namespace perdure::test {

using Settings = std::vector<std::string>;

class BridgeRig {
 public:
  BridgeRig();

  void startBridge(const Settings& settings);
  /// Starts a node that subscribes to `topics`, or to all if none is given. Without `domain`, it
  /// uses the bus's domain.
  void listen(const std::vector<std::string>& topics = {}, const std::string& domain = {});
  /// Starts a node that publishes these lines (ros_speaker.cpp).
  void speak(const std::vector<nlohmann::json>& lines, bool by_sensor_qos = false,
             const std::string& domain = {});

  /// Returns the messages that the listener has received so far, by topic.
  std::map<std::string, std::vector<nlohmann::json>> heard() const;
  bool said() const;
  std::string log() const;

  /// Counts and the latest message of the bridge's Health, as received so far.
  std::uint64_t count(const std::string& reason) const;
  const std::string& sentence() const { return sentence_; }

  Folder folder;
  bus::Domain domain{ownNetwork()};
  bus::Participant participant{domain, "test"};
  bus::WaitLoop loop{participant};

 private:
  std::string domainId() const;

  bus::Reader<Health> health_{participant, bus::kTopic<Health>};
  std::map<std::string, std::uint64_t> reasons_;
  std::string sentence_;
  std::unique_ptr<Child> bridge_, listener_;
  int listeners_ = 0;
  std::vector<std::unique_ptr<Child>> speakers_;
};

/// Returns a line of a script, for example "Image" on "/camera/image_raw" with its stamp, sent
/// `after` s.
nlohmann::json lineOf(const std::string& type, const std::string& topic, double after,
                      std::int64_t stamp_ns, nlohmann::json more = nlohmann::json::object());

}  // namespace perdure::test
