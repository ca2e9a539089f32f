// perdure-ros2: the bridge to ROS 2, without ROS libraries.
#include <chrono>
#include <functional>
#include <list>
#include <memory>
#include <set>
#include <vector>

#include "common/bus/topics.h"
#include "common/replay/files/rig_file.h"
#include "common/ros/bytes.h"
#include "common/service/on_demand.h"
#include "common/vision/jpeg.h"
#include "services/ros2/node.h"
#include "services/ros2/ros_side.h"

namespace {

using namespace perdure;
using service::monotonicNs;

/// Output side: publishes the data of the bus in ROS.
class Outwards {
 public:
  Outwards(service::Context& context, const ros2::Config& config, ros2::RosSide& ros)
      : context_(context),
        config_(config),
        ros_(ros),
        mirror_(
            config.prefix, [&](const auto& outlet, auto cdr) { ros.write(outlet, std::move(cdr)); },
            [&](const auto& outlet) { return ros.wants(outlet.topic); }) {
    mirror_.sayTrackedObjects(config.tracked_objects);
    mirror_.sayClock(config.clock);
    for (const ros::Outlet& outlet : mirror_.outlets(config.shown_cameras)) {
      if (config.tf || !outlet.topic.starts_with("/tf")) ros.advertise(outlet);
    }
    listenAlways();
    followWhatIsWanted();
    context.loop().onWake([this] {
      for (auto& one : followers_) one.follow();
    });
    context.every(std::chrono::milliseconds(200), [this] { context_.loop().wake(); });
    context.countReasons([this]() -> const ReasonCounts& { return reasons_; });
  }

 private:
  std::string topic(const char* name) const { return config_.prefix + "/" + name; }

  /// Reads topics that are latched or needed by others; their messages are small and infrequent.
  void listenAlways() {
    context_.onCalibration([this](const Calibration& m) { mirror_.onCalibration(m); });
    context_.on(bus::kTopic<ModelInfo>, [this](const ModelInfo& m) { mirror_.onModel(m); });
    context_.on(bus::kTopic<MapFrame>, [this](const MapFrame& m) { mirror_.onMapFrame(m); });
    context_.on(bus::kTopic<Health>, [this](const Health& m) { mirror_.onHealth(m); });
    context_.on(bus::kTopic<Odometry>, [this](const Odometry& m) { mirror_.onOdometry(m); });
  }

  template <class T>
  void add(const bus::Topic<T>& topic, std::vector<std::string> outlets, Sink<T> handler) {
    followers_.emplace_back(
        context_, topic,
        [this, outlets = std::move(outlets)] {
          return std::ranges::any_of(outlets,
                                     [this](const std::string& one) { return ros_.wants(one); });
        },
        std::move(handler));
  }

  void followWhatIsWanted() {
    // The IMU is also read for odometry, whose twist contains the angular rate.
    add<ImuSample>(bus::kTopic<ImuSample>, {topic("imu"), topic("odometry")},
                   [this](const ImuSample& m) { mirror_.onImu(m); });
    add<Landmarks>(bus::kTopic<Landmarks>, {topic("landmarks")},
                   [this](const Landmarks& m) { mirror_.onLandmarks(m); });
    add<Detections>(bus::kTopic<Detections>, {topic("detections")},
                    [this](const Detections& m) { mirror_.onDetections(m); });
    std::vector<std::string> of_objects{topic("objects"), topic("markers"), topic("obstacles")};
    if (!config_.tracked_objects.empty()) of_objects.push_back(config_.tracked_objects);
    add<Objects>(bus::kTopic<Objects>, std::move(of_objects), [this](const Objects& m) {
      mirror_.onObjects(m);
      // The rate in Health is that of the images if the bridge reads any, else that of these
      // messages.
      if (!config_.cam0.given()) context_.health().frameOut();
    });
    for (const std::string& camera : config_.shown_cameras) {
      const std::string image = mirror_.imageTopic(camera);
      add<Frame>(bus::frameTopic(camera),
                 {image, image + "/compressed", topic((camera + "/camera_info").c_str())},
                 [this](const Frame& m) { onFrame(m); });
    }
  }

  /// Publishes the raw and the compressed image, if their topics have readers.
  void onFrame(const Frame& frame) {
    mirror_.onFrame(frame);
    const std::string image = mirror_.imageTopic(frame.camera);
    const bool packed = isCompressed(frame.encoding);
    if (!ros_.wants(packed ? image : image + "/compressed")) return;
    const auto other = packed ? vision::decompressed(frame)
                              : vision::compressed(frame, static_cast<int>(config_.image_quality));
    if (other) {
      mirror_.onImage(*other);
    } else {
      reasons_.add(other.error());
    }
  }

  service::Context& context_;
  const ros2::Config& config_;
  ros2::RosSide& ros_;
  ros::Mirror mirror_;
  std::list<service::OnDemand> followers_;  ///< each reader exists while ROS reads its output
  ReasonCounts reasons_;
};

/// Input side: publishes the data of ROS drivers as Perdure's topics.
class Inwards {
 public:
  Inwards(service::Context& context, const ros2::Config& config, ros2::RosSide& ros)
      : context_(context),
        config_(config),
        ros_(ros),
        node_(config, rigOf(config, context), context.instance(), outputs()) {
    context.countReasons([this]() -> const ReasonCounts& { return node_.troubles().counts(); });
    listenToCameras();
    listenToOthers();
    listenToOwnFrames();
    node_.start();
  }

  std::pair<HealthState, std::string> health() {
    for (const auto& [code, sentence] : node_.troubles().sentences()) {
      if (sentence.empty() || !logged_.insert(code).second) continue;
      context_.log().warn("{}, first: {}", code, sentence);
    }
    return node_.health(monotonicNs());
  }

 private:
  static Calibration rigOf(const ros2::Config& config, service::Context& context) {
    if (config.rig.empty()) return {};
    std::vector<std::string> notes;
    Calibration rig = replay::readRigParts(config.rig, &notes).sensors;
    for (const std::string& note : notes) context.log().info("{}", note);
    return rig;
  }

  ros2::Outputs outputs() {
    ros2::Outputs to;
    for (const ros2::CameraInput& camera : config_.cameras())
      frames_[camera.name] = context_.sink(bus::frameTopic(camera.name));
    to.frame = [this](const Frame& m) {
      frames_.at(m.camera)(m);
      if (m.camera == config_.cam0.name) context_.health().frameOut();
    };
    if (config_.cam0.given()) to.calibration = context_.sink(bus::kTopic<Calibration>);
    if (config_.imu.given()) to.imu = context_.sink(bus::kTopic<ImuSample>);
    if (config_.odometry.given()) to.odometry = context_.sink(bus::kTopic<Odometry>);
    if (config_.detections.given()) {
      constexpr double kLease = 1.0;  // s; fixed, because the rate of ROS detectors is not known
      auto& detections = context_.writer(
          bus::kTopic<Detections>,
          {.strength = static_cast<std::int32_t>(config_.detections.strength), .lease_s = kLease});
      to.detections = [&detections](const Detections& m) { (void)detections.write(m); };
      to.model = context_.sink(bus::kTopic<ModelInfo>);
    }
    return to;
  }

  /// Adds a reader that passes parsed messages to `take`, and counts malformed ones.
  template <class M>
  void read(const std::string& input, const std::string& topic, int depth,
            std::function<void(const M&)> take, bool latched = false) {
    ros_.read(
        input, topic, M::kType, config_.reliable, latched, depth,
        [this, input, topic, take = std::move(take)](const SharedBytes& cdr) {
          auto message =
              ros::messageOf<M>(*cdr, ros::Encoding::kCdr, std::make_shared<SharedBytes>(cdr));
          if (message) return take(*message);
          node_.onMalformed(input,
                            {"malformed", topic + " has messages that are no whole " + M::kType +
                                              "; is its writer of another "
                                              "version of ROS?"},
                            monotonicNs());
        });
  }

  void listenToCameras() {
    constexpr int kImages = 4, kInfos = 4;
    const auto cameras = config_.cameras();
    for (std::size_t i = 0; i < cameras.size(); ++i) {
      const ros2::CameraInput& camera = cameras[i];
      auto& images = context_.needs("images of " + camera.name, "start its driver again");
      const auto onImage = [this, i, &images](const auto& m) {
        images.heard();
        if (i == 0) context_.health().frameIn();
        node_.onImage(i, m, monotonicNs());
      };
      if (camera.compressed()) {
        read<ros::CompressedImage>(camera.name, camera.image, kImages, onImage);
      } else {
        read<ros::Image>(camera.name, camera.image, kImages, onImage);
      }
      read<ros::CameraInfo>(camera.name + "_info", camera.infoTopic(), kInfos,
                            [this, i](const auto& m) { node_.onInfo(i, m, monotonicNs()); });
    }
    if (cameras.empty() && !config_.odometry.given()) return;
    constexpr int kTransforms = 100;
    read<ros::TFMessage>(
        "tf_static", "/tf_static", kTransforms, [this](const auto& m) { node_.onTransforms(m); },
        true);
  }

  void listenToOthers() {
    constexpr int kSamples = 512, kPoses = 128, kBoxes = 16;
    if (config_.imu.given()) {
      auto& samples = context_.needs("inertial samples", "start the driver of the IMU again");
      read<ros::Imu>("imu", config_.imu.topic, kSamples, [this, &samples](const auto& m) {
        samples.heard();
        node_.onImu(m, monotonicNs());
      });
    }
    if (config_.odometry.given()) {
      auto& poses = context_.needs("odometry of ROS", "start the node that publishes it");
      read<ros::Odometry>("odometry", config_.odometry.topic, kPoses,
                          [this, &poses](const auto& m) {
                            poses.heard();
                            node_.onOdometry(m, monotonicNs());
                          });
    }
    if (config_.detections.given()) {
      read<ros::Detection2DArray>("detections", config_.detections.topic, kBoxes,
                                  [this](const auto& m) { node_.onDetections(m, monotonicNs()); });
    }
  }

  /// Reads the frames of Perdure's capture, because poses and boxes from ROS need their stamps.
  void listenToOwnFrames() {
    if (config_.cam0.given() || !(config_.odometry.given() || config_.detections.given())) return;
    context_.on(bus::frameTopic(config_.detections.camera), [this](const Frame& m) {
      if (!once_.first(m.stamp.source, m.stamp.sequence)) return;
      node_.onOwnFrame(m, monotonicNs());
    });
  }

  service::Context& context_;
  const ros2::Config& config_;
  ros2::RosSide& ros_;
  std::map<std::string, Sink<Frame>> frames_;
  ros2::Node node_;
  bus::Once once_;
  std::set<std::string> logged_;
};

void serve(service::Context& context, const ros2::Config& config) {
  ros2::RosSide ros(context, config);
  std::unique_ptr<Inwards> in;
  std::unique_ptr<Outwards> out;
  if (config.anyInput()) in = std::make_unique<Inwards>(context, config, ros);
  if (config.out) out = std::make_unique<Outwards>(context, config, ros);
  context.onHealth([&] {
    const auto [state, sentence] = in ? in->health() : std::pair(HealthState::kOk, std::string());
    const std::string trouble = state == HealthState::kOk ? ros.trouble() : std::string();
    if (trouble.empty()) return context.health().state(state, sentence);
    context.health().state(HealthState::kDegraded, trouble);
  });
  context.run();
}

}  // namespace

int main(int argc, char** argv) {
  ros2::Config config;
  return service::runService(
      argc, argv,
      {.process = "ros2",
       .summary = "Perdure's topics for ROS 2, and drivers of ROS 2 for Perdure, without ROS.",
       .describe = [&](config::Fields& fields) { ros2::describe(config, fields); },
       .body = [&](service::Context& context) { serve(context, config); },
       .verify = [&] { ros2::verify(config); }});
}
