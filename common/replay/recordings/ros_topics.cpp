#include "common/replay/recordings/ros_topics.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>

#include "common/base/errors.h"

namespace perdure::replay {
namespace {

constexpr char kImage[] = "sensor_msgs/Image", kCompressed[] = "sensor_msgs/CompressedImage";
constexpr char kInfo[] = "sensor_msgs/CameraInfo", kImu[] = "sensor_msgs/Imu";
constexpr std::string_view kPacked = "/compressed";

std::string parentOf(const std::string& topic) { return topic.substr(0, topic.rfind('/')); }

/// The common name of the topics "/cam0/image_raw" and "/cam0/image_raw/compressed".
std::string streamOf(const std::string& topic) {
  return topic.ends_with(kPacked) ? topic.substr(0, topic.size() - kPacked.size()) : topic;
}

std::vector<std::string> ofTypes(const RosTopics& topics, std::vector<std::string> types) {
  std::vector<std::string> names;
  for (const auto& [name, topic] : topics) {
    const bool one = std::find(types.begin(), types.end(), topic.type) != types.end();
    if (one && topic.messages > 0) names.push_back(name);
  }
  return names;
}

std::string listOf(const std::vector<std::string>& names) {
  return fmt::format("{}", fmt::join(names, ", "));
}

/// "left" → "1st", "cam1" → "cam0": replaces the second name of a pair by the first.
std::string asFirst(std::string name) {
  const std::pair<const char*, const char*> kNames[] = {
      {"right", "left"}, {"cam1", "cam0"}, {"camera1", "camera0"}, {"infra2", "infra1"}};
  for (const auto& [second, first] : kNames) {
    const auto at = name.find(second);
    if (at != std::string::npos) return name.replace(at, std::strlen(second), first);
  }
  return name;
}

class Choice {
 public:
  Choice(const RosTopics& topics, const std::map<std::string, std::string>& wanted,
         const std::string& file)
      : topics_(topics), wanted_(wanted), file_(file) {}

  ChosenTopics made() {
    checkWanted();
    ChosenTopics chosen;
    for (const std::string& stream : streams()) chosen.cameras.push_back(cameraOf(stream));
    for (CameraTopics& camera : chosen.cameras) {
      camera.info = infoOf(camera.image, chosen.cameras.size() == 1);
    }
    chosen.imu = imu();
    return chosen;
  }

 private:
  [[noreturn]] void stop(const std::string& what) const {
    throw StartupError(ExitCode::kUnavailable, file_ + " " + what);
  }

  std::string wantedAs(const std::string& role) const {
    const auto given = wanted_.find(role);
    return given == wanted_.end() ? "" : given->second;
  }

  void checkWanted() const {
    for (const auto& [role, topic] : wanted_) {
      const auto types = role == "imu" ? std::vector<std::string>{kImu}
                                       : std::vector<std::string>{kImage, kCompressed};
      const auto there = ofTypes(topics_, types);
      if (std::find(there.begin(), there.end(), topic) != there.end()) continue;
      stop("has no messages of " + types.front() + " on " + topic + ", which " + role +
           " should be; it has " + (there.empty() ? "none on any topic" : listOf(there)));
    }
  }

  /// Image topics; a topic and its compressed variant count as one. If a camera has several, and
  /// one of them is image_raw, only that one is included.
  std::vector<std::string> candidates() const {
    std::map<std::string, std::vector<std::string>> by_camera;
    for (const auto& topic : ofTypes(topics_, {kImage, kCompressed})) {
      if (topic.ends_with("/compressedDepth") || topic.find("/depth") != std::string::npos)
        continue;
      auto& streams = by_camera[parentOf(streamOf(topic))];
      if (streams.empty() || streams.back() != streamOf(topic)) streams.push_back(streamOf(topic));
    }
    std::vector<std::string> all;
    for (const auto& [camera, streams] : by_camera) {
      const auto raw = std::find(streams.begin(), streams.end(), camera + "/image_raw");
      if (raw != streams.end()) {
        all.push_back(*raw);
      } else {
        all.insert(all.end(), streams.begin(), streams.end());
      }
    }
    return all;
  }

  std::vector<std::string> streams() const {
    if (!wantedAs("cam0").empty()) {
      std::vector<std::string> streams{wantedAs("cam0")};
      if (!wantedAs("cam1").empty()) streams.push_back(wantedAs("cam1"));
      return streams;
    }
    const auto all = candidates();
    if (all.empty()) {
      const auto depth = ofTypes(topics_, {kImage, kCompressed});
      stop(depth.empty()
               ? "holds no images (sensor_msgs/Image or CompressedImage)" + imagesOfOthers()
               : "holds depth alone (" + listOf(depth) + "); record a camera's images too");
    }
    if (all.size() == 1) return all;
    const bool pair = all.size() == 2;
    if (pair && asFirst(all[1]) == all[0]) return all;
    if (pair && asFirst(all[0]) == all[1]) return {all[1], all[0]};
    stop("holds images of several cameras: " + listOf(all) +
         "; say which to take: cam0=TOPIC, of a pair also cam1=TOPIC (pipeline and demo: --topic; "
         "capture: dataset.topics; elsewhere `rostopic: TOPIC` under cam0 in the file of --rig)");
  }

  /// Names an image topic of an unsupported type: "; those on /cam are
  /// foxglove_msgs/CompressedImage, which is not read".
  std::string imagesOfOthers() const {
    for (const auto& [name, topic] : topics_) {
      const bool ours = topic.type == kImage || topic.type == kCompressed;
      if (!ours && topic.messages > 0 && topic.type.find("Image") != std::string::npos)
        return "; those on " + name + " are " + topic.type + ", which is not read";
    }
    return "; record them too";
  }

  CameraTopics cameraOf(const std::string& stream) const {
    CameraTopics camera;
    const auto raw = topics_.find(stream);
    const bool is_raw =
        raw != topics_.end() && raw->second.type == kImage && raw->second.messages > 0;
    const bool is_packed = raw != topics_.end() && raw->second.type == kCompressed;
    camera.image = is_raw || is_packed ? stream : stream + std::string(kPacked);
    camera.compressed = !is_raw;
    camera.rectified = stream.find("rect", stream.rfind('/')) != std::string::npos;
    return camera;
  }

  std::string infoOf(const std::string& image, bool alone) const {
    const auto all = ofTypes(topics_, {kInfo});
    const std::string beside = parentOf(streamOf(image)) + "/camera_info";
    if (std::find(all.begin(), all.end(), beside) != all.end()) return beside;
    return alone && all.size() == 1 ? all.front() : "";
  }

  /// Returns the topic of the other sensor if a driver publishes accelerometer and gyroscope
  /// separately. RealSense's driver uses /camera/accel/sample and /camera/gyro/sample.
  std::string otherHalfOf(const std::string& topic) const {
    for (const auto& [half, other] : {std::pair("accel", "gyro"), std::pair("gyro", "accel")}) {
      const auto at = topic.rfind(half);
      if (at == std::string::npos) continue;
      std::string name = topic;
      name.replace(at, std::strlen(half), other);
      const auto known = topics_.find(name);
      if (known != topics_.end() && known->second.type == kImu) return name;
    }
    return "";
  }

  [[noreturn]] void stopAtHalf(const std::string& topic) const {
    stop("has its inertial unit in two halves, accelerometer and gyroscope: " + topic + " and " +
         otherHalfOf(topic) +
         "; record it as one topic: realsense2_camera with unite_imu_method:=2 (ROS 1: "
         "linear_interpolation)");
  }

  std::string imu() const {
    const std::string wanted = wantedAs("imu");
    if (!wanted.empty() && !otherHalfOf(wanted).empty()) stopAtHalf(wanted);
    if (!wanted.empty()) return wanted;
    auto all = ofTypes(topics_, {kImu});
    const std::string half = all.empty() ? "" : all.front();
    std::erase_if(all, [this](const auto& topic) { return !otherHalfOf(topic).empty(); });
    if (all.empty() && !half.empty()) stopAtHalf(half);
    if (all.size() > 1) {
      stop("holds several inertial units: " + listOf(all) +
           "; say which to take: imu=TOPIC (pipeline and demo: --topic; capture: dataset.topics; "
           "elsewhere `rostopic: TOPIC` under imu0 in the file of --rig)");
    }
    return all.empty() ? "" : all.front();
  }

  const RosTopics& topics_;
  const std::map<std::string, std::string>& wanted_;
  const std::string& file_;
};

}  // namespace

std::map<std::string, std::string> topicsOf(const std::vector<std::string>& assignments) {
  std::map<std::string, std::string> topics;
  for (const std::string& one : assignments) {
    const auto sign = one.find('=');
    const std::string role = one.substr(0, sign);
    if (sign == std::string::npos || (role != "cam0" && role != "cam1" && role != "imu")) {
      throw StartupError(ExitCode::kUsage, "`" + one +
                                               "` names no topic; write cam0=TOPIC, "
                                               "cam1=TOPIC or imu=TOPIC");
    }
    topics[role] = one.substr(sign + 1);
  }
  return topics;
}

ChosenTopics chooseTopics(const RosTopics& topics, const std::map<std::string, std::string>& wanted,
                          const std::string& file) {
  return Choice(topics, wanted, file).made();
}

}  // namespace perdure::replay
