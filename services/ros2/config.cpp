#include "services/ros2/config.h"

#include "common/base/errors.h"

namespace perdure::ros2 {
namespace {

constexpr std::string_view kPacked = "/compressed";

void describeRos(Config& c, config::Fields& fields) {
  fields.integer("ros.domain", c.domain, config::between(-1, 230),
                 {"ROS_DOMAIN_ID; -1: as bus.domain"});
  fields.text("ros.interface", c.interface,
              {"network interfaces to ROS, as eth0,wlan0; empty: all that are up, at most four; "
               "lo: this host only"});
  fields.texts("ros.peers", c.peers,
               {"addresses of the ROS hosts, if multicast does not reach them; empty: multicast"});
}

void describeOut(Config& c, config::Fields& fields) {
  fields.boolean("out.enabled", c.out, {"publish Perdure's topics in ROS"});
  fields.text("out.prefix", c.prefix, {"prefix of all topics except /tf and /tf_static"});
  fields.texts("out.cameras", c.shown_cameras, {"cameras whose images are available"});
  fields.boolean("out.tf", c.tf,
                 {"publish /tf and /tf_static; false if another node publishes odom to base_link"});
  fields.boolean("out.clock", c.clock,
                 {"publish /clock, the time of the newest odometry, for nodes with use_sim_time; "
                  "for drives with stamps of their own"});
  fields.text("out.tracked_objects", c.tracked_objects,
              {"topic of autoware_perception_msgs/TrackedObjects, which Autoware reads; empty: "
               "none"});
}

void describeCamera(CameraInput& camera, config::Fields& fields) {
  const std::string key = "in." + camera.name + ".";
  fields.text(key + "image", camera.image,
              {"topic of sensor_msgs/Image or CompressedImage; empty: none"});
  fields.text(key + "info", camera.info,
              {"topic of its CameraInfo; empty: camera_info beside the image"});
}

void describeIn(Config& c, config::Fields& fields) {
  describeCamera(c.cam0, fields);
  describeCamera(c.cam1, fields);
  fields.text("in.imu.topic", c.imu.topic, {"topic of sensor_msgs/Imu; empty: none"});
  fields.text("in.odometry.topic", c.odometry.topic,
              {"topic of nav_msgs/Odometry, instead of perdure-vio; empty: none"});
  DetectionsInput& d = c.detections;
  fields.text("in.detections.topic", d.topic,
              {"topic of vision_msgs/Detection2DArray; empty: none"});
  fields.text("in.detections.camera", d.camera, {"camera whose images the detector reads"});
  fields.texts(
      "in.detections.classes", d.classes,
      {"the detector's classes, with the names of class_priors.yaml; a class_id is a name, "
       "or an index in this list"});
  fields.choice("in.detections.boxes", d.boxes, {"outline", "cuboid", "unknown"},
                {"boxes enclose the visible outline (COCO), or the projected cuboid (KITTI); "
                 "unknown: estimated"});
  fields.text("in.rig", c.rig,
              {"file with cameras or IMU, written by `perdure calibrate`; overrides CameraInfo and "
               "/tf_static"});
  fields.text("in.body", c.body,
              {"frame of the body; empty: the IMU's frame, or without an IMU the child frame of "
               "the odometry"});
}

void describeExpertClock(std::string& clock, const std::string& input, config::Fields& fields) {
  fields.choice("in." + input + ".clock", clock, {kSameClock, kOwnClock},
                {"same: stamps are on the clock of the other inputs; own: on another clock"});
}

void describeExpertCamera(CameraInput& camera, config::Fields& fields) {
  const std::string key = "in." + camera.name + ".";
  fields.choice(key + "type", camera.type, {"auto", "raw", "compressed"},
                {"raw: Image; compressed: CompressedImage; auto: compressed if the topic's name "
                 "ends with /compressed"});
  describeExpertClock(camera.clock, camera.name, fields);
  fields.integer(key + "bits", camera.bits, config::between(0, 16),
                 {"used bits of 16-bit images (8 … 16); 0: derived from the brightest pixel so "
                  "far"});
}

void describeExpertDetections(DetectionsInput& d, config::Fields& fields) {
  fields.number("in.detections.other_share", d.other_share, config::between(0.0, 0.9),
                {"share of the remaining probability of the scores for classes without a score; "
                 "the rest is clutter"});
  fields.number("in.detections.box_sigma", d.box_sigma, config::between(0.0, 1.0),
                {"standard deviation of a box side, relative to the size of the box; 0: unknown"});
  fields.integer("in.detections.strength", d.strength, config::between(0, 1000000),
                 {"strength compared with perdure-inference on the same topic; the running process "
                  "with the highest strength is used"});
}

void describeExpertIn(Config& c, config::Fields& fields) {
  describeExpertCamera(c.cam0, fields);
  describeExpertCamera(c.cam1, fields);
  describeExpertClock(c.imu.clock, "imu", fields);
  describeExpertClock(c.odometry.clock, "odometry", fields);
  fields.number("in.odometry.sigma_position", c.odometry.sigma_position, config::positive(),
                {"standard deviation of the position, if the message has no covariance", "m"});
  fields.number("in.odometry.sigma_rotation", c.odometry.sigma_rotation, config::positive(),
                {"standard deviation of the rotation, if the message has no covariance", "rad"});
  fields.number("in.odometry.jump", c.odometry.jump_m, config::positive(),
                {"a pose farther from its prediction begins a new frame of reference; the limit "
                 "increases with speed",
                 "m"});
  describeExpertDetections(c.detections, fields);
  fields.number("in.apart_s", c.apart_s, config::positive(),
                {"largest difference of arrival − stamp between inputs on one clock; messages "
                 "beyond it are dropped",
                 "s"});
  fields.boolean("in.reliable", c.reliable,
                 {"request lost messages again; this excludes best-effort drivers"});
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
  describeIn(c, fields);
  fields.expert(true);
  fields.integer("out.image_quality", c.image_quality, config::between(1, 100),
                 {"quality of JPEG in image_raw/compressed; JPEG images are sent unchanged"});
  describeExpertIn(c, fields);
  fields.expert(false);
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
  if (!c.out && !c.anyInput()) {
    refuseConfig("nothing goes out and nothing comes in: set out.enabled, or a topic under in");
  }
}

}  // namespace perdure::ros2
