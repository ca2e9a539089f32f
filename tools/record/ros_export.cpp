// `perdure record export --ros2`.
#include <utility>

#include "common/base/errors.h"
#include "common/replay/recordings/mcap_writer.h"
#include "common/replay/recordings/recorded_messages.h"
#include "common/ros/definition.h"
#include "common/ros/mirror.h"
#include "tools/record/files.h"

namespace perdure::tools {
namespace {

namespace mcap = replay::mcap;

/// QoS of a topic's writer in the format of ROS 2's recorder.
std::string qosOf(const ros::Outlet& outlet) {
  const std::string forever = "\n    sec: 9223372036\n    nsec: 854775807\n";
  return std::string("- history: 1\n  depth: ") + (outlet.latched ? "1" : "10") +
         "\n  reliability: 1\n  durability: " + (outlet.latched ? "1" : "2") +
         "\n  deadline:" + forever + "  lifespan:" + forever +
         "  liveliness: 1\n  liveliness_lease_duration:" + forever +
         "  avoid_ros_namespace_conventions: false";
}

[[noreturn]] void cannotWrite(const Reason& reason) {
  throw StartupError(ExitCode::kInputOutput, reason.detail);
}

class Ros2File {
 public:
  explicit Ros2File(const std::filesystem::path& path) : file_(created(path)) {}

  void add(const ros::Outlet& outlet, const std::vector<std::uint8_t>& cdr, std::uint64_t log_ns) {
    constexpr std::size_t kLargest = 4u << 20;
    draft_.add({channelOf(outlet), ++sequence_, log_ns, log_ns, cdr});
    if (draft_.bytes() >= kLargest) cut();
  }
  bool empty() const { return sequence_ == 0; }
  void finish() {
    cut();
    if (const auto done = file_.finish(); !done) cannotWrite(done.error());
  }

 private:
  static mcap::Writer created(const std::filesystem::path& path) {
    auto file = mcap::Writer::create(path, "ros2");
    if (!file) throw StartupError(mcap::exitCodeOf(file.error()), file.error().detail);
    return *std::move(file);
  }
  void cut() {
    if (draft_.empty()) return;
    const auto done = file_.append(mcap::pack(std::exchange(draft_, {})), catalogue_);
    if (!done) cannotWrite(done.error());
  }
  std::uint16_t channelOf(const ros::Outlet& outlet) {
    const auto next = static_cast<std::uint16_t>(channels_.size() + 1);
    const auto [known, is_new] = channels_.emplace(outlet.topic, next);
    if (!is_new) return known->second;
    catalogue_.channels[next] = {
        next, schemaOf(outlet), outlet.topic, "cdr", {{"offered_qos_profiles", qosOf(outlet)}}};
    return next;
  }
  std::uint16_t schemaOf(const ros::Outlet& outlet) {
    const auto next = static_cast<std::uint16_t>(schemas_.size() + 1);
    const auto [known, is_new] = schemas_.emplace(outlet.type, next);
    if (is_new) {
      catalogue_.schemas[next] = {next, ros::ros2Name(outlet.type), "ros2msg", outlet.definition};
    }
    return known->second;
  }

  mcap::Writer file_;
  mcap::Catalogue catalogue_;
  mcap::Draft draft_;
  std::map<std::string, std::uint16_t> channels_, schemas_;
  std::uint32_t sequence_ = 0;
};

class Export {
 public:
  Export(replay::RecordedMessages& recording, Ros2File& file)
      : recording_(recording),
        mirror_("/perdure", [this, &file](const ros::Outlet& outlet, auto cdr) {
          file.add(outlet, cdr, now_ns_);
        }) {}

  /// Writes the messages that describe others first, whatever their time, then all others.
  ReasonCounts run() {
    recording_.rewind([](const std::string& topic) { return topic == "model"; });
    while (const auto message = recording_.next()) take(*message);
    now_ns_ = recording_.startNs();
    recording_.rewind([](const std::string& topic) { return topic == "calibration"; });
    if (const auto message = recording_.next()) takeAs(*message, &ros::Mirror::onCalibration);
    recording_.rewind(isMirrored);
    while (const auto message = recording_.next()) {
      now_ns_ = message->log_ns;
      take(*message);
    }
    reasons_.add(recording_.reasons());
    return reasons_;
  }

 private:
  static bool isMirrored(const std::string& topic) {
    return topic == "imu" || topic == "odometry" || topic == "landmarks" || topic == "detections" ||
           topic == "map/frame" || topic == "objects" || topic == "health" ||
           topic.starts_with("frame/");
  }

  template <class T>
  void takeAs(const replay::RecordedMessage& message, void (ros::Mirror::*on)(const T&)) {
    const auto value = replay::valueOf<T>(message);
    if (value) return (mirror_.*on)(*value);
    reasons_.add(message.topic + "_" + value.error().code);
  }

  void take(const replay::RecordedMessage& message) {
    using ros::Mirror;
    const std::string& topic = message.topic;
    if (topic == "imu") return takeAs(message, &Mirror::onImu);
    if (topic == "odometry") return takeAs(message, &Mirror::onOdometry);
    if (topic == "landmarks") return takeAs(message, &Mirror::onLandmarks);
    if (topic == "model") return takeAs(message, &Mirror::onModel);
    if (topic == "detections") return takeAs(message, &Mirror::onDetections);
    if (topic == "map/frame") return takeAs(message, &Mirror::onMapFrame);
    if (topic == "objects") return takeAs(message, &Mirror::onObjects);
    if (topic == "health") return takeAs(message, &Mirror::onHealth);
    takeAs(message, &Mirror::onFrame);
  }

  replay::RecordedMessages& recording_;
  std::uint64_t now_ns_ = 0;
  ReasonCounts reasons_;
  ros::Mirror mirror_;
};

}  // namespace

ReasonCounts exportRos2(const std::filesystem::path& from, const std::filesystem::path& to) {
  replay::RecordedMessages recording(from);
  if (!recording.next()) refuseNothing(recording, from);
  Ros2File file(to);
  NewFile made(to);
  const ReasonCounts reasons = Export(recording, file).run();
  if (file.empty()) refuseForeign(from, reasons);
  file.finish();
  made.keep();
  return reasons;
}

}  // namespace perdure::tools
