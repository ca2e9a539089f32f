#include "tests/interop/ros2/bridge_rig.h"

#include <gtest/gtest.h>
#include <signal.h>

#include <cstdlib>
#include <fstream>
#include <sstream>

#include "tests/services/run_until.h"

namespace perdure::test {

using nlohmann::json;

BridgeRig::BridgeRig() {
  loop.on(health_, [this](const Health& m) {
    if (m.process != "ros2") return;
    reasons_ = m.reasons;
    if (!m.message.empty()) sentence_ = m.message;
  });
}

std::string BridgeRig::domainId() const {
  const char* leased = std::getenv("PERDURE_DOMAIN");
  return leased != nullptr ? leased : "0";
}

void BridgeRig::startBridge(const Settings& settings) {
  std::vector<std::string> command{(programs() / "perdure-ros2").string()};
  for (const std::string& setting : settings) command.insert(command.end(), {"--set", setting});
  bridge_ = std::make_unique<Child>(command, folder.file("bridge.log"));
  ASSERT_TRUE(runUntil(loop, [&] { return health_.matched() > 0; })) << bridge_->log();
}

void BridgeRig::listen(const std::vector<std::string>& topics, const std::string& at) {
  std::vector<std::string> command{std::getenv("PERDURE_ROS_LISTENER"),
                                   at.empty() ? domainId() : at};
  command.insert(command.end(), topics.begin(), topics.end());
  if (listener_) {
    listener_->signal(SIGTERM);
    EXPECT_EQ(listener_->wait(std::chrono::seconds(5)), 0) << listener_->log();
  }
  listener_ =
      std::make_unique<Child>(command, folder.file("listener" + std::to_string(++listeners_)));
}

void BridgeRig::speak(const std::vector<json>& lines, bool by_sensor_qos, const std::string& at) {
  const std::string number = std::to_string(speakers_.size());
  const std::string script = folder.file("script" + number);
  std::ofstream file(script);
  for (const json& line : lines) file << line.dump() << '\n';
  file.close();
  std::vector<std::string> command{std::getenv("PERDURE_ROS_SPEAKER"), at.empty() ? domainId() : at,
                                   script};
  if (by_sensor_qos) command.push_back("sensor");
  speakers_.push_back(std::make_unique<Child>(command, folder.file("speaker" + number)));
}

std::map<std::string, std::vector<json>> BridgeRig::heard() const {
  std::map<std::string, std::vector<json>> by_topic;
  std::istringstream text(listener_->log());
  for (std::string line; std::getline(text, line);) {
    const json message = json::parse(line, nullptr, false);  // the last line may be incomplete
    if (message.is_object()) by_topic[message["topic"]].push_back(message);
  }
  return by_topic;
}

bool BridgeRig::said() const {
  bool all = true;
  for (const auto& one : speakers_) all = all && one->log().find("said\n") != std::string::npos;
  return all;
}

std::string BridgeRig::log() const {
  std::string text = "bridge: " + (bridge_ ? bridge_->log() : "") + "\nhealth: " + sentence_;
  for (const auto& [reason, n] : reasons_) text += "\n  " + reason + " " + std::to_string(n);
  if (listener_) text += "\nlistener: " + listener_->log().substr(0, 2000);
  for (const auto& one : speakers_) text += "\nspeaker: " + one->log();
  return text;
}

std::uint64_t BridgeRig::count(const std::string& reason) const {
  const auto known = reasons_.find(reason);
  return known == reasons_.end() ? 0 : known->second;
}

json lineOf(const std::string& type, const std::string& topic, double after, std::int64_t stamp_ns,
            json more) {
  more["type"] = type, more["topic"] = topic, more["after"] = after, more["stamp"] = stamp_ns;
  return more;
}

}  // namespace perdure::test
