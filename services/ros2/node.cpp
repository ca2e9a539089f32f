#include "services/ros2/node.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

#include "common/ros/images.h"
#include "common/ros/sensors.h"
#include "common/vision/decode.h"
#include "common/vision/image.h"

namespace perdure::ros2 {
namespace {

constexpr std::size_t kMostEarly = 16;

std::vector<RigCamera> rigCameras(const std::vector<CameraInput>& cameras) {
  std::vector<RigCamera> all;
  for (const CameraInput& camera : cameras) {
    const bool rectified = camera.image.find("rect") != std::string::npos;
    all.push_back({camera.name, camera.infoTopic(), rectified});
  }
  return all;
}

ModelInfo modelOf(const DetectionsInput& d, InstanceId instance) {
  ModelInfo model;
  model.instance = instance;
  model.name = "ros2:" + d.topic;
  for (std::string name : d.classes) {
    std::ranges::transform(name, name.begin(),
                           [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    model.classes.push_back(name);
  }
  model.box_sigma = d.box_sigma;
  model.boxes = d.boxes == "cuboid"    ? BoxExtent::kCuboid
                : d.boxes == "outline" ? BoxExtent::kOutline
                                       : BoxExtent::kUnknown;
  std::string all = model.name + fmt::format("\n{} {} {}", d.boxes, d.box_sigma, d.other_share);
  for (const std::string& name : model.classes) all += "\n" + name;
  model.hash = digest(all);
  return model;
}

Result<Frame> unpacked(const ros::CompressedImage& image, int bits) {
  const std::string_view bytes(reinterpret_cast<const char*>(image.data->data()),
                               image.data->size());
  const auto pixels = vision::decodeImage(bytes, std::nullopt, bits);
  if (!pixels) {
    return fail(pixels.error().code, "an image ({}) cannot be unpacked; JPEG and PNG are read: {}",
                image.format.substr(0, 64), pixels.error().detail);
  }
  Frame frame;
  const auto set = vision::setPixels(frame, *pixels);
  return set ? Result<Frame>(frame) : tl::unexpected(set.error());
}

}  // namespace

Node::Node(const Config& config, Calibration rig, InstanceId instance, Outputs outputs)
    : config_(config),
      cameras_(config.cameras()),
      instance_(instance),
      outputs_(std::move(outputs)),
      clocks_(durationFromSeconds(config.apart_s)),
      rig_(rigCameras(cameras_), std::move(rig), config.imu.given(), config.odometry.given(),
           config.body),
      poses_(
          {config.odometry.sigma_position, config.odometry.sigma_rotation, config.odometry.jump_m},
          {instance, 0}),
      model_(modelOf(config.detections, instance)),
      bits_(cameras_.size(), 8) {
  for (const CameraInput& camera : cameras_)
    clocks_.addInput(camera.name, camera.clock == kSameClock);
  if (config.imu.given()) clocks_.addInput("imu", config.imu.clock == kSameClock);
  if (config.odometry.given()) clocks_.addInput("odometry", config.odometry.clock == kSameClock);
}

void Node::start() {
  if (config_.detections.given()) outputs_.model(model_);
}

std::optional<TimePoint> Node::placed(const std::string& input, const ros::Header& header,
                                      std::int64_t now_ns) {
  const auto time = clocks_.place(input, header.stamp, now_ns);
  if (time) return *time;
  troubles_.add(input, time.error(), now_ns);
  return std::nullopt;
}

/// Returns the number of bits that the brightest image so far needs, so that a dark first image
/// does not determine it.
int Node::bitsOf(std::size_t camera, const ros::Image& image) {
  if (image.encoding != "mono16" && image.encoding != "16UC1") return 16;
  if (cameras_[camera].bits > 0) return static_cast<int>(cameras_[camera].bits);
  if (bits_[camera] < 16) bits_[camera] = std::max(bits_[camera], ros::usedBits(image));
  return bits_[camera];
}

void Node::onImage(std::size_t camera, const ros::Image& image, std::int64_t now_ns) {
  takeImage(camera, image.header, ros::frameOf(image, bitsOf(camera, image)), now_ns);
}

void Node::onImage(std::size_t camera, const ros::CompressedImage& image, std::int64_t now_ns) {
  const auto bits = cameras_[camera].bits > 0 ? cameras_[camera].bits : 16;
  takeImage(camera, image.header, unpacked(image, static_cast<int>(bits)), now_ns);
}

void Node::takeImage(std::size_t camera, const ros::Header& header, Result<Frame> frame,
                     std::int64_t now_ns) {
  const std::string& name = cameras_[camera].name;
  if (!frame) return troubles_.add(name, frame.error(), now_ns);
  const auto time = placed(name, header, now_ns);
  if (!time) return;
  rig_.onImageOf(camera, header.frame_id, *time);
  tellRig();
  frame->camera = name;
  frame->stamp.source = instance_;
  frame->stamp.time = *time;
  frame->stamp.captured_ns = now_ns;
  if (fits(camera, *frame, now_ns))
    giveFrame(camera, *std::move(frame), ros::timeOf(header.stamp), now_ns);
}

bool Node::fits(std::size_t camera, const Frame& frame, std::int64_t now_ns) {
  if (!rig_.complete()) {
    troubles_.add(frame.camera, {"before_calibration", ""}, now_ns);
    return false;
  }
  const CameraCalibration& is = rig_.complete()->cameras[camera];
  if (frame.width == is.width && frame.height == is.height) return true;
  troubles_.add(
      frame.camera,
      {"image_size", fmt::format("images of {} are {}x{}, and its calibration is of "
                                 "{}x{}; calibrate at the size that the driver gives",
                                 frame.camera, frame.width, frame.height, is.width, is.height)},
      now_ns);
  return false;
}

void Node::giveFrame(std::size_t camera, Frame frame, TimePoint ros_stamp, std::int64_t now_ns) {
  if (camera > 0) {
    if (const auto paired = stereo_.onSecond(std::move(frame))) outputs_.frame(*paired);
    if (stereo_.overflowed()) {
      troubles_.add(cameras_[camera].name,
                    {"unpaired",
                     "images of cam1 have no image of cam0 within 10 ms; trigger both "
                     "cameras at one time"},
                    now_ns);
    }
    return;
  }
  frame.stamp.sequence = next_frame_++;
  outputs_.frame(frame);
  const FrameStamp stamp = frame.stamp;
  for (const Frame& second : stereo_.onFirst(stamp)) outputs_.frame(second);
  noteFrame(ros_stamp, stamp, now_ns);
}

void Node::onInfo(std::size_t camera, const ros::CameraInfo& info, std::int64_t now_ns) {
  if (const auto taken = rig_.onInfo(camera, info); !taken) {
    troubles_.add(
        cameras_[camera].name,
        {"info_" + taken.error().code,
         cameras_[camera].name + ": " + taken.error().detail + "; calibrate it, or give in.rig"},
        now_ns);
  }
  tellRig();
}

void Node::onTransforms(const ros::TFMessage& message) {
  rig_.onTransforms(message);
  tellRig();
}

void Node::tellRig() {
  auto calibration = rig_.news();
  if (!calibration) return;
  calibration->source = instance_;
  outputs_.calibration(*calibration);
}

void Node::onImu(const ros::Imu& imu, std::int64_t now_ns) {
  ImuSample sample = ros::sampleOf(imu);
  constexpr double kMostGyro = 100.0, kMostAccel = 1000.0;  // rad/s, m/s²; no IMU exceeds them
  if (!(sample.gyro.norm() < kMostGyro) || !(sample.accel.norm() < kMostAccel)) {
    return troubles_.add("imu",
                         {"not_finite",
                          "inertial samples have values that are not finite or beyond any "
                          "sensor; they are left out: fix the driver"},
                         now_ns);
  }
  const auto time = placed("imu", imu.header, now_ns);
  if (!time) return;
  rig_.onImuOf(imu.header.frame_id);
  tellRig();
  sample.time = *time;
  sample.source = instance_;
  sample.sequence = next_sample_++;
  outputs_.imu(sample);
}

void Node::onOdometry(const ros::Odometry& odometry, std::int64_t now_ns) {
  const auto time = placed("odometry", odometry.header, now_ns);
  if (!time) return;
  rig_.onOdometryOf(odometry.child_frame_id);
  tellRig();
  const auto T_child_body = rig_.bodyIn(odometry.child_frame_id);
  if (!T_child_body) {
    return troubles_.add("odometry",
                         {"frame_unknown", "no way is known from odometry's child `" +
                                               odometry.child_frame_id.substr(0, 64) +
                                               "` to the body; let /tf_static say it, or set "
                                               "in.body to that frame"},
                         now_ns);
  }
  if (const auto taken = poses_.onOdometry(odometry, *time, *T_child_body); !taken)
    troubles_.add("odometry", taken.error(), now_ns);
  tellPoses(now_ns);
}

void Node::tellPoses(std::int64_t now_ns) {
  const std::uint64_t before = poses_.untold();
  for (Odometry& pose : poses_.take()) {
    pose.instance = instance_;
    outputs_.odometry(pose);
  }
  for (std::uint64_t n = before; n < poses_.untold(); ++n)
    troubles_.add("odometry",
                  {"gap",
                   "frames have no pose: odometry began after them, or has a "
                   "gap of more than half a second"},
                  now_ns);
}

void Node::noteFrame(TimePoint ros_stamp, const FrameStamp& stamp, std::int64_t now_ns) {
  book_.add(ros_stamp, stamp);
  if (config_.odometry.given()) {
    if (const auto waits = poses_.onFrame(stamp); !waits)
      troubles_.add("odometry", waits.error(), now_ns);
    tellPoses(now_ns);
  }
  std::deque<ros::Detection2DArray> early;
  early.swap(early_);
  for (const auto& detections : early) onDetections(detections, now_ns);
}

void Node::onOwnFrame(const Frame& frame, std::int64_t now_ns) {
  clocks_.observeCommon(frame.stamp.time, now_ns);
  noteFrame(frame.stamp.time, frame.stamp, now_ns);
}

void Node::onDetections(const ros::Detection2DArray& detections, std::int64_t now_ns) {
  const auto& first = detections.detections;
  // Some detectors set the stamp only in the boxes.
  const bool stamped = ros::timeOf(detections.header.stamp) != TimePoint() || first.empty();
  const TimePoint stamp =
      ros::timeOf(stamped ? detections.header.stamp : first.front().header.stamp);
  if (const FrameStamp* frame = book_.find(stamp))
    return giveDetections(detections, *frame, now_ns);
  if (book_.isAfterAll(stamp)) {
    early_.push_back(detections);
    if (early_.size() <= kMostEarly) return;
    early_.pop_front();
  }
  troubles_.add(
      "detections",
      {"of_no_frame", "detections have stamps that no image of " + config_.detections.camera +
                          " has; the detector has to copy the stamp of its image"},
      now_ns);
}

void Node::giveDetections(const ros::Detection2DArray& message, const FrameStamp& stamp,
                          std::int64_t now_ns) {
  BoxesRead read = boxesOf(message, model_.classes, config_.detections.other_share);
  for (const Reason& reason : read.refused) troubles_.add("detections", reason, now_ns);
  Detections detections;
  detections.stamp = stamp;
  detections.camera = config_.detections.camera;
  detections.instance = instance_;
  detections.model_hash = model_.hash;
  detections.detections = std::move(read.detections);
  outputs_.detections(detections);
}

std::pair<HealthState, std::string> Node::health(std::int64_t now_ns) const {
  constexpr std::int64_t kRecent = 5'000'000'000;
  const std::string problem = troubles_.newest(now_ns, kRecent);
  const std::string missing = cameras_.empty() || rig_.complete() ? "" : rig_.missing();
  if (missing.empty() && problem.empty()) return {HealthState::kOk, ""};
  const std::string both = missing.empty()   ? problem
                           : problem.empty() ? missing
                                             : problem + "; " + missing;
  return {HealthState::kDegraded, both};
}

}  // namespace perdure::ros2
