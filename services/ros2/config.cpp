#include "services/ros2/config.h"

#include <algorithm>

#include "common/base/errors.h"

namespace perdure::ros2 {
namespace {

constexpr std::string_view kPacked = "/compressed";

void describeRos(Config& c, config::Fields& fields) {
  fields.integer("ros.domain", c.domain, config::between(-1, 230),
                 {"ROS_DOMAIN_ID; -1: the bus's own domain, with its interface"});
  fields.text("ros.interface", c.interface,
              {"of a ros.domain of its own: the network interface; empty: that of the bus"});
  fields.texts("ros.peers", c.peers,
               {"of a ros.domain of its own: addresses of ROS' hosts; none: multicast"});
}

void describeOut(Config& c, config::Fields& fields) {
  fields.boolean("out.enabled", c.out, {"Perdure's topics go to ROS"});
  fields.text("out.prefix", c.prefix, {"before all topics but /tf and /tf_static"});
  fields.texts("out.cameras", c.shown_cameras, {"cameras whose images may be subscribed"});
  fields.boolean("out.tf", c.tf,
                 {"writes /tf and /tf_static; false where another node says odom to base_link"});
  fields.text(
      "out.tracked_objects", c.tracked_objects,
      {"topic of autoware_perception_msgs/TrackedObjects, as Autoware hears it; empty: none"});
  fields.integer("out.image_quality", c.image_quality, config::between(1, 100),
                 {"of the JPEG of image_raw/compressed; what is JPEG already stays as it is"});
}

void describeClock(std::string& clock, const std::string& input, config::Fields& fields) {
  fields.choice("in." + input + ".clock", clock, {kSameClock, kOwnClock},
                {"same: stamps are of the clock that the other inputs have; own: of another one"});
}

void describeCamera(CameraInput& camera, config::Fields& fields) {
  const std::string key = "in." + camera.name + ".";
  fields.text(key + "image", camera.image,
              {"topic of sensor_msgs/Image or CompressedImage; empty: none"});
  fields.choice(key + "type", camera.type, {"auto", "raw", "compressed"},
                {"which of the two; auto: by the topic's name, …/compressed"});
  fields.text(key + "info", camera.info,
              {"topic of its CameraInfo; empty: camera_info beside the image"});
  describeClock(camera.clock, camera.name, fields);
  fields.integer(
      key + "bits", camera.bits, config::between(0, 16),
      {"used bits of images with 16 (8 … 16); 0: as many as the brightest so far needs"});
}

void describeDetections(DetectionsInput& d, config::Fields& fields) {
  fields.text("in.detections.topic", d.topic,
              {"topic of vision_msgs/Detection2DArray; empty: none"});
  fields.text("in.detections.camera", d.camera, {"the camera on whose images it looks"});
  fields.texts("in.detections.classes", d.classes,
               {"its classes, by the names of class_priors.yaml; a class_id is a name, or the "
                "number of one in this list"});
  fields.number("in.detections.other_share", d.other_share, config::between(0.0, 0.9),
                {"of the probability that its scores leave: so much is for classes that it does "
                 "not name, the rest for clutter"});
  fields.number("in.detections.box_sigma", d.box_sigma, config::between(0.0, 1.0),
                {"deviation of a side of its boxes, relative to their size; 0: not known"});
  fields.choice("in.detections.boxes", d.boxes, {"outline", "cuboid"},
                {"what they enclose: the visible outline (COCO), or the projected cuboid (KITTI)"});
  fields.integer("in.detections.strength", d.strength, config::between(0, 1000000),
                 {"against perdure-inference on the same topic; the highest that lives is heard"});
}

}  // namespace

bool CameraInput::compressed() const {
  return type == "compressed" || (type == "auto" && image.ends_with(kPacked));
}

std::string CameraInput::infoTopic() const {
  if (!info.empty()) return info;
  const std::string stream =
      image.ends_with(kPacked) ? image.substr(0, image.size() - kPacked.size()) : image;
  return stream.substr(0, stream.rfind('/')) + "/camera_info";
}

std::vector<CameraInput> Config::cameras() const {
  std::vector<CameraInput> given;
  for (const CameraInput* camera : {&cam0, &cam1})
    if (camera->given()) given.push_back(*camera);
  return given;
}

bool Config::anyInput() const {
  return cam0.given() || imu.given() || odometry.given() || detections.given();
}

void describe(Config& c, config::Fields& fields) {
  describeRos(c, fields);
  describeOut(c, fields);
  describeCamera(c.cam0, fields);
  describeCamera(c.cam1, fields);
  fields.text("in.imu.topic", c.imu.topic, {"topic of sensor_msgs/Imu; empty: none"});
  describeClock(c.imu.clock, "imu", fields);
  fields.text("in.odometry.topic", c.odometry.topic,
              {"topic of nav_msgs/Odometry, in place of perdure-vio; empty: none"});
  describeClock(c.odometry.clock, "odometry", fields);
  fields.number("in.odometry.sigma_position", c.odometry.sigma_position, config::positive(),
                {"where its covariance says nothing", "m"});
  fields.number("in.odometry.sigma_rotation", c.odometry.sigma_rotation, config::positive(),
                {"where its covariance says nothing", "rad"});
  fields.number(
      "in.odometry.jump", c.odometry.jump_m, config::positive(),
      {"a pose so far from where its velocity leads begins a new frame of reference", "m"});
  describeDetections(c.detections, fields);
  fields.text("in.rig", c.rig,
              {"file with cameras or IMU, as `perdure calibrate` writes it; goes before "
               "CameraInfo and /tf_static"});
  fields.text("in.body", c.body,
              {"frame of the body; empty: the IMU's, without one the odometry's child"});
  fields.number("in.apart_s", c.apart_s, config::positive(),
                {"stamps of one clock that come so far apart are of two", "s"});
  fields.boolean("in.reliable", c.reliable,
                 {"asks that lost messages be sent again; best-effort drivers are then not heard"});
}

namespace {

[[noreturn]] void refuseConfig(const std::string& sentence) {
  throw StartupError(ExitCode::kConfiguration, sentence);
}

void requireTopic(const char* key, const std::string& topic) {
  if (topic.empty()) return;
  const bool plain = topic.starts_with('/') && topic.size() > 1 &&
                     topic.find_first_of(" \t\n*?") == std::string::npos && !topic.ends_with('/');
  if (!plain) {
    refuseConfig(std::string(key) + ": \"" + topic +
                 "\" is no topic of ROS; write its whole name, as `ros2 topic list` shows it");
  }
}

}  // namespace

void verify(const Config& c) {
  requireTopic("in.cam0.image", c.cam0.image);
  requireTopic("in.cam0.info", c.cam0.info);
  requireTopic("in.cam1.image", c.cam1.image);
  requireTopic("in.cam1.info", c.cam1.info);
  requireTopic("in.imu.topic", c.imu.topic);
  requireTopic("in.odometry.topic", c.odometry.topic);
  requireTopic("in.detections.topic", c.detections.topic);
  requireTopic("out.prefix", c.prefix);
  requireTopic("out.tracked_objects", c.tracked_objects);
  if (c.cam1.given() && !c.cam0.given()) {
    refuseConfig("in.cam1.image is given and in.cam0.image is not; the first camera is cam0");
  }
  if (c.imu.given() && !c.cam0.given()) {
    refuseConfig(
        "in.imu.topic is given and in.cam0.image is not: camera and IMU come from one source, for "
        "they share one calibration; take both from ROS, or both from perdure-capture");
  }
  if (c.detections.given() && c.detections.classes.empty()) {
    refuseConfig("in.detections.classes is empty; list the detector's classes, as [car, person]");
  }
  for (const CameraInput& camera : c.cameras()) {
    if (camera.bits > 0 && camera.bits < 8)
      refuseConfig("in." + camera.name + ".bits is under 8; write 8 … 16, or 0");
  }
  if (c.domain < 0 && (!c.interface.empty() || !c.peers.empty())) {
    refuseConfig(
        "ros.interface and ros.peers are of a ros.domain of its own, and that is -1: set "
        "ros.domain to ROS_DOMAIN_ID, other than bus.domain, or use bus.interface");
  }
  if (!c.out && !c.anyInput()) {
    refuseConfig("nothing goes out and nothing comes in: set out.enabled, or a topic under in");
  }
}

}  // namespace perdure::ros2
