// Subscribes to the topics of perdure-ros2 as ROS 2 nodes do, and prints each message as a line of
// JSON. With TOPICs, it subscribes only to those.
// usage: ros_listener DOMAIN [TOPIC…]
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <nlohmann/json.hpp>
#include <numeric>
#include <set>
#include <thread>
#include <vector>

#include "tests/interop/ros2/ros_node.h"

namespace {

using namespace perdure::test;
using nlohmann::json;
namespace sensor = sensor_msgs::msg::dds_;
namespace vision = vision_msgs::msg::dds_;

std::int64_t nsOf(const builtin_interfaces::msg::dds_::Time_& t) {
  return t.sec() * 1'000'000'000LL + t.nanosec();
}
json of(const std_msgs::msg::dds_::Header_& h) {
  return {{"stamp", nsOf(h.stamp())}, {"frame", h.frame_id()}};
}
template <class V>
json xyz(const V& v) {
  return {v.x(), v.y(), v.z()};
}
template <class Q>
json xyzw(const Q& q) {
  return {q.x(), q.y(), q.z(), q.w()};
}
template <class P>
json of(const P& pose) {
  return {{"p", xyz(pose.position())}, {"q", xyzw(pose.orientation())}};
}
std::uint64_t sumOf(const std::vector<std::uint8_t>& bytes) {
  return std::accumulate(bytes.begin(), bytes.end(), std::uint64_t{0});
}

json linesOf(const tf2_msgs::msg::dds_::TFMessage_& m) {
  json all = json::array();
  for (const auto& t : m.transforms())
    all.push_back({{"header", of(t.header())},
                   {"child", t.child_frame_id()},
                   {"p", xyz(t.transform().translation())},
                   {"q", xyzw(t.transform().rotation())}});
  return {{"transforms", all}};
}
json linesOf(const rosgraph_msgs::msg::dds_::Clock_& m) { return {{"clock", nsOf(m.clock())}}; }
json linesOf(const nav_msgs::msg::dds_::Odometry_& m) {
  return {{"header", of(m.header())},
          {"child", m.child_frame_id()},
          {"pose", of(m.pose().pose())},
          {"covariance", m.pose().covariance()},
          {"linear", xyz(m.twist().twist().linear())},
          {"angular", xyz(m.twist().twist().angular())},
          {"twist_covariance", m.twist().covariance()}};
}
json linesOf(const sensor::Imu_& m) {
  return {{"header", of(m.header())},
          {"gyro", xyz(m.angular_velocity())},
          {"accel", xyz(m.linear_acceleration())},
          {"orientation_covariance", m.orientation_covariance()[0]}};
}
json linesOf(const sensor::Image_& m) {
  return {{"header", of(m.header())}, {"height", m.height()}, {"width", m.width()},
          {"encoding", m.encoding()}, {"step", m.step()},     {"size", m.data().size()},
          {"sum", sumOf(m.data())}};
}
json linesOf(const sensor::CompressedImage_& m) {
  const auto& d = m.data();
  const bool jpeg = d.size() > 4 && d[0] == 0xFF && d[1] == 0xD8 && d[d.size() - 1] == 0xD9;
  return {{"header", of(m.header())}, {"format", m.format()}, {"jpeg", jpeg}};
}
json linesOf(const sensor::CameraInfo_& m) {
  return {{"header", of(m.header())},
          {"height", m.height()},
          {"width", m.width()},
          {"model", m.distortion_model()},
          {"d", m.d()},
          {"k", m.k()},
          {"p", m.p()}};
}
json linesOf(const sensor::PointCloud2_& m) {
  json names = json::array();
  for (const auto& f : m.fields()) names.push_back(f.name());
  return {{"header", of(m.header())},
          {"width", m.width()},
          {"fields", names},
          {"step", m.point_step()},
          {"data", m.data()}};
}
json linesOf(const vision::ObjectHypothesisWithPose_& r) {
  return {{"class", r.hypothesis().class_id()},
          {"score", r.hypothesis().score()},
          {"pose", of(r.pose().pose())},
          {"variance_x", r.pose().covariance()[0]}};
}
template <class Results>
json resultsOf(const Results& results) {
  json all = json::array();
  for (const auto& r : results) all.push_back(linesOf(r));
  return all;
}
json linesOf(const vision::Detection2DArray_& m) {
  json all = json::array();
  for (const auto& d : m.detections())
    all.push_back({{"results", resultsOf(d.results())},
                   {"x", d.bbox().center().position().x()},
                   {"y", d.bbox().center().position().y()},
                   {"w", d.bbox().size_x()},
                   {"h", d.bbox().size_y()}});
  return {{"header", of(m.header())}, {"detections", all}};
}
json linesOf(const vision::Detection3DArray_& m) {
  json all = json::array();
  for (const auto& d : m.detections())
    all.push_back({{"id", d.id()},
                   {"results", resultsOf(d.results())},
                   {"center", of(d.bbox().center())},
                   {"size", xyz(d.bbox().size())}});
  return {{"header", of(m.header())}, {"detections", all}};
}
json linesOf(const visualization_msgs::msg::dds_::MarkerArray_& m) {
  json all = json::array();
  for (const auto& one : m.markers())
    all.push_back({{"ns", one.ns()},
                   {"type", one.type()},
                   {"action", one.action()},
                   {"pose", of(one.pose())},
                   {"scale", xyz(one.scale())},
                   {"points", one.points().size()},
                   {"text", one.text()}});
  return {{"markers", all}};
}
json linesOf(const diagnostic_msgs::msg::dds_::DiagnosticArray_& m) {
  json all = json::array();
  for (const auto& s : m.status()) {
    json values = json::object();
    for (const auto& v : s.values()) values[v.key()] = v.value();
    all.push_back(
        {{"level", s.level()}, {"name", s.name()}, {"message", s.message()}, {"values", values}});
  }
  return {{"header", of(m.header())}, {"status", all}};
}

json linesOf(const autoware_perception_msgs::msg::dds_::TrackedObjects_& m) {
  json all = json::array();
  for (const auto& o : m.objects()) {
    json labels = json::array();
    for (const auto& c : o.classification()) labels.push_back({c.label(), c.probability()});
    const auto& k = o.kinematics();
    all.push_back({{"uuid", o.object_id().uuid()},
                   {"existence", o.existence_probability()},
                   {"classification", labels},
                   {"pose", of(k.pose_with_covariance().pose())},
                   {"covariance", k.pose_with_covariance().covariance()},
                   {"linear", xyz(k.twist_with_covariance().twist().linear())},
                   {"orientation", k.orientation_availability()},
                   {"stationary", k.is_stationary()},
                   {"type", o.shape().type()},
                   {"size", xyz(o.shape().dimensions())}});
  }
  return {{"header", of(m.header())}, {"objects", all}};
}

volatile std::sig_atomic_t g_ends = 0;

class Listener {
 public:
  explicit Listener(std::uint32_t domain, std::set<std::string> wanted)
      : node_(domain), wanted_(std::move(wanted)) {}

  template <class Message, class PubSubType>
  void hear(const std::string& topic, Quality quality) {
    if (!wanted_.empty() && !wanted_.contains(topic)) return;
    fast::DataReader* reader = node_.reader<PubSubType>(topic, quality);
    polls_.push_back([reader, topic] {
      fast::SampleInfo info;
      Message message;
      while (reader->take_next_sample(&message, &info) == ReturnCode_t::RETCODE_OK) {
        if (!info.valid_data) continue;
        json line = linesOf(message);
        line["topic"] = topic;
        std::printf("%s\n", line.dump(-1, ' ', false, json::error_handler_t::replace).c_str());
        std::fflush(stdout);
      }
    });
  }
  /// Runs until SIGTERM. It then leaves the domain like a node that is shut down, so that no lease
  /// has to expire.
  void run() {
    std::signal(SIGTERM, [](int) { g_ends = 1; });
    while (g_ends == 0) {
      for (const auto& poll : polls_) poll();
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
  }

 private:
  RosNode node_;
  std::set<std::string> wanted_;
  std::vector<std::function<void()>> polls_;
};

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) return 64;
  Listener all(static_cast<std::uint32_t>(std::atoi(argv[1])), {argv + 2, argv + argc});
  using namespace tf2_msgs::msg::dds_;
  using namespace visualization_msgs::msg::dds_;
  using namespace diagnostic_msgs::msg::dds_;
  all.hear<TFMessage_, TFMessage_PubSubType>("/tf", Quality::kDefault);
  all.hear<TFMessage_, TFMessage_PubSubType>("/tf_static", Quality::kLatched);
  all.hear<nav_msgs::msg::dds_::Odometry_, nav_msgs::msg::dds_::Odometry_PubSubType>(
      "/perdure/odometry", Quality::kDefault);
  all.hear<sensor::Imu_, sensor::Imu_PubSubType>("/perdure/imu", Quality::kSensor);
  all.hear<sensor::Image_, sensor::Image_PubSubType>("/perdure/cam0/image_raw", Quality::kSensor);
  all.hear<sensor::CompressedImage_, sensor::CompressedImage_PubSubType>(
      "/perdure/cam0/image_raw/compressed", Quality::kSensor);
  all.hear<sensor::CameraInfo_, sensor::CameraInfo_PubSubType>("/perdure/cam0/camera_info",
                                                               Quality::kSensor);
  all.hear<sensor::PointCloud2_, sensor::PointCloud2_PubSubType>("/perdure/landmarks",
                                                                 Quality::kSensor);
  all.hear<vision::Detection2DArray_, vision::Detection2DArray_PubSubType>("/perdure/detections",
                                                                           Quality::kDefault);
  all.hear<vision::Detection3DArray_, vision::Detection3DArray_PubSubType>("/perdure/objects",
                                                                           Quality::kDefault);
  all.hear<MarkerArray_, MarkerArray_PubSubType>("/perdure/markers", Quality::kDefault);
  all.hear<sensor::PointCloud2_, sensor::PointCloud2_PubSubType>("/perdure/obstacles",
                                                                 Quality::kSensor);
  all.hear<rosgraph_msgs::msg::dds_::Clock_, rosgraph_msgs::msg::dds_::Clock_PubSubType>(
      "/clock", Quality::kSensor);
  all.hear<DiagnosticArray_, DiagnosticArray_PubSubType>("/perdure/diagnostics", Quality::kDefault);
  all.hear<autoware_perception_msgs::msg::dds_::TrackedObjects_,
           autoware_perception_msgs::msg::dds_::TrackedObjects_PubSubType>(
      "/perception/object_recognition/tracking/objects", Quality::kDefault);
  all.run();
}
