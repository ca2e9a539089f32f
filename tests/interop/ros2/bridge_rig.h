// perdure-ros2 between a test, which is on Perdure's bus, and nodes of ROS 2 that Fast DDS plays.
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
  /// A node that subscribes, on the bus's domain unless another is given; all topics if none is.
  void listen(const std::vector<std::string>& topics = {}, const std::string& domain = {});
  /// A node that says these lines (ros_speaker.cpp).
  void speak(const std::vector<nlohmann::json>& lines, bool by_sensor_qos = false,
             const std::string& domain = {});

  /// What the listener heard so far, by topic.
  std::map<std::string, std::vector<nlohmann::json>> heard() const;
  bool said() const;
  std::string log() const;

  /// Counts and the newest sentence of the bridge's Health, by what came so far.
  std::uint64_t count(const std::string& reason) const;
  const std::string& sentence() const { return sentence_; }

  Folder folder;
  bus::Domain domain{ownNetwork()};
  bus::Participant participant{domain, "test"};
  bus::WaitLoop loop{participant};

 private:
  std::string domainId() const;

  bus::Reader<Health> health_{participant, bus::topics::kHealth};
  std::map<std::string, std::uint64_t> reasons_;
  std::string sentence_;
  std::unique_ptr<Child> bridge_, listener_;
  int listeners_ = 0;
  std::vector<std::unique_ptr<Child>> speakers_;
};

/// A line of a script: "Image" on "/camera/image_raw", stamped, said `after` s.
nlohmann::json lineOf(const std::string& type, const std::string& topic, double after,
                      std::int64_t stamp_ns, nlohmann::json more = nlohmann::json::object());

}  // namespace perdure::test
