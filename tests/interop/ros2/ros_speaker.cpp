// Plays a script as ROS 2 drivers would. A line of JSON is a message, with its `topic`, `type`,
// `stamp` (ns), `frame`, and `after` (s since the start). With `sensor`, images, samples and infos
// use SensorDataQoS. The script begins when every topic has a reader.
// usage: ros_speaker DOMAIN SCRIPT [sensor]
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <thread>

#include "tests/interop/ros2/ros_node.h"

namespace {

using namespace perdure::test;
using nlohmann::json;
namespace sensor = sensor_msgs::msg::dds_;
namespace vision = vision_msgs::msg::dds_;

/// Reads a number, or a string such as "nan", which JSON cannot represent as a number.
double numberOf(const json& value) {
  return value.is_string() ? std::strtod(value.get<std::string>().c_str(), nullptr)
                           : value.get<double>();
}
template <class V>
void setXyz(V& to, const json& value) {
  to.x(numberOf(value[0])), to.y(numberOf(value[1])), to.z(numberOf(value[2]));
}
template <class Q>
void setXyzw(Q& to, const json& value) {
  setXyz(to, value);
  to.w(numberOf(value[3]));
}
template <class Array>
void setNumbers(Array& to, const json& values) {
  for (std::size_t i = 0; i < to.size() && i < values.size(); ++i) to[i] = numberOf(values[i]);
}
std::vector<std::uint8_t> contentsOf(const json& line) {
  if (!line.contains("file")) return std::vector<std::uint8_t>(line.value("bytes", 0u), 100);
  std::ifstream file(line["file"].get<std::string>(), std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}
void setHeader(std_msgs::msg::dds_::Header_& header, const json& line) {
  const std::int64_t ns = line.value("stamp", std::int64_t{0});
  header.stamp().sec(static_cast<std::int32_t>(ns / 1'000'000'000));
  header.stamp().nanosec(static_cast<std::uint32_t>(ns % 1'000'000'000));
  header.frame_id(line.value("frame", ""));
}

void fill(sensor::Image_& m, const json& line) {
  setHeader(m.header(), line);
  m.height(line["height"]), m.width(line["width"]), m.encoding(line["encoding"]);
  m.step(line["step"]), m.data(contentsOf(line));
}
void fill(sensor::CompressedImage_& m, const json& line) {
  setHeader(m.header(), line);
  m.format(line["format"]), m.data(contentsOf(line));
}
void fill(sensor::CameraInfo_& m, const json& line) {
  setHeader(m.header(), line);
  m.height(line["height"]), m.width(line["width"]), m.distortion_model(line["model"]);
  m.d(line["d"].get<std::vector<double>>());
  setNumbers(m.k(), line["k"]);
}
void fill(sensor::Imu_& m, const json& line) {
  setHeader(m.header(), line);
  m.orientation_covariance()[0] = -1;
  setXyz(m.angular_velocity(), line["gyro"]), setXyz(m.linear_acceleration(), line["accel"]);
}
void fill(nav_msgs::msg::dds_::Odometry_& m, const json& line) {
  setHeader(m.header(), line);
  m.child_frame_id(line["child"]);
  setXyz(m.pose().pose().position(), line["p"]);
  setXyzw(m.pose().pose().orientation(), line["q"]);
  setXyz(m.twist().twist().linear(), line["linear"]);
  if (line.contains("covariance")) setNumbers(m.pose().covariance(), line["covariance"]);
}
void fill(vision::Detection2DArray_& m, const json& line) {
  setHeader(m.header(), line);
  for (const json& one : line["detections"]) {
    vision::Detection2D_ box;
    setHeader(box.header(), line);
    box.bbox().center().position().x(numberOf(one["x"]));
    box.bbox().center().position().y(numberOf(one["y"]));
    box.bbox().size_x(numberOf(one["w"])), box.bbox().size_y(numberOf(one["h"]));
    for (const auto& [name, score] : one["scores"].items()) {
      vision::ObjectHypothesisWithPose_ result;
      result.hypothesis().class_id(name), result.hypothesis().score(numberOf(score));
      box.results().push_back(result);
    }
    m.detections().push_back(box);
  }
}
void fill(tf2_msgs::msg::dds_::TFMessage_& m, const json& line) {
  for (const json& one : line["transforms"]) {
    geometry_msgs::msg::dds_::TransformStamped_ t;
    t.header().frame_id(one["parent"]), t.child_frame_id(one["child"]);
    setXyz(t.transform().translation(), one["p"]), setXyzw(t.transform().rotation(), one["q"]);
    m.transforms().push_back(t);
  }
}
/// A message with this type name but fewer fields than readers expect.
void fill(std_msgs::msg::dds_::Header_& m, const json& line) { setHeader(m, line); }

class Speaker {
 public:
  Speaker(std::uint32_t domain, bool by_sensor_qos)
      : node_(domain), sensors_(by_sensor_qos ? Quality::kSensor : Quality::kDefault) {}

  void add(const json& line) {
    if (ways_.contains(line["topic"])) return;
    const std::string type = line["type"];
    if (type == "Image") way<sensor::Image_, sensor::Image_PubSubType>(line, sensors_);
    if (type == "CompressedImage")
      way<sensor::CompressedImage_, sensor::CompressedImage_PubSubType>(line, sensors_);
    if (type == "CameraInfo")
      way<sensor::CameraInfo_, sensor::CameraInfo_PubSubType>(line, sensors_);
    if (type == "Imu") way<sensor::Imu_, sensor::Imu_PubSubType>(line, sensors_);
    if (type == "Odometry")
      way<nav_msgs::msg::dds_::Odometry_, nav_msgs::msg::dds_::Odometry_PubSubType>(
          line, Quality::kDefault);
    if (type == "Detection2DArray")
      way<vision::Detection2DArray_, vision::Detection2DArray_PubSubType>(line, Quality::kDefault);
    if (type == "TFMessage")
      way<tf2_msgs::msg::dds_::TFMessage_, tf2_msgs::msg::dds_::TFMessage_PubSubType>(
          line, Quality::kLatched);
    if (type == "ShortImu") way<std_msgs::msg::dds_::Header_, ShortImu>(line, Quality::kSensor);
  }
  bool heard() const {
    for (const auto& [topic, way] : ways_) {
      fast::PublicationMatchedStatus status;
      way.writer->get_publication_matched_status(status);
      if (status.current_count == 0) return false;
    }
    return true;
  }
  std::string waits() const {
    std::string topics;
    for (const auto& [topic, way] : ways_) {
      fast::PublicationMatchedStatus status;
      way.writer->get_publication_matched_status(status);
      if (status.current_count == 0) topics += " " + topic;
    }
    return topics;
  }
  void say(const json& line) { ways_.at(line["topic"]).say(line); }

 private:
  struct ShortImu : std_msgs::msg::dds_::Header_PubSubType {
    ShortImu() { setName("sensor_msgs::msg::dds_::Imu_"); }
  };
  struct Way {
    fast::DataWriter* writer;
    std::function<void(const json&)> say;
  };
  template <class Message, class PubSubType>
  void way(const json& line, Quality quality) {
    fast::DataWriter* writer = node_.writer<PubSubType>(line["topic"], quality);
    ways_[line["topic"]] = {writer, [writer](const json& content) {
                              Message message;
                              fill(message, content);
                              writer->write(&message);
                            }};
  }

  RosNode node_;
  Quality sensors_;
  std::map<std::string, Way> ways_;
};

}  // namespace

int main(int argc, char** argv) {
  using Clock = std::chrono::steady_clock;
  if (argc < 3) return 64;
  std::ifstream script(argv[2]);
  std::vector<json> lines;
  for (std::string line; std::getline(script, line);) lines.push_back(json::parse(line));
  Speaker speaker(static_cast<std::uint32_t>(std::atoi(argv[1])), argc > 3);
  for (const json& line : lines) speaker.add(line);
  const auto patience = Clock::now() + std::chrono::seconds(20);
  while (!speaker.heard() && Clock::now() < patience)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  std::printf("%s%s\n", speaker.heard() ? "heard" : "not heard:", speaker.waits().c_str());
  std::fflush(stdout);
  // Fast DDS' readers receive latched samples some time after a match.
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  const auto start = Clock::now();
  for (const json& line : lines) {
    std::this_thread::sleep_until(start + std::chrono::duration<double>(line.value("after", 0.0)));
    speaker.say(line);
  }
  std::printf("said\n");
  std::fflush(stdout);
  while (true) std::this_thread::sleep_for(std::chrono::seconds(1));
}
