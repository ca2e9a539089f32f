// A ROS recording as a dataset: images, inertial samples, and calibration from camera_info and
// tf_static. The rig file overrides this calibration. Images are read on request.
#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>
#include <tuple>
#include <utility>

#include "common/base/errors.h"
#include "common/replay/files/rig_file.h"
#include "common/replay/recording.h"
#include "common/replay/recordings/ros_topics.h"
#include "common/ros/images.h"
#include "common/ros/sensors.h"
#include "common/vision/decode.h"
#include "common/vision/image.h"

namespace perdure::replay {
namespace {

constexpr char kTransforms[] = "/tf_static";

/// The times of a sensor's message.
struct Arrival {
  TimePoint time;  ///< stamp of the header; corrected at the end (files/stamp_order.h)
  std::uint64_t log_ns = 0, place = 0;  ///< as in RosMessage
};

/// Reference to one image in the recording; its pixels are read on request.
struct RosImage : Arrival {
  std::uint64_t number = 0;  ///< position by the time of recording
};

struct RosSample : Arrival {
  ImuSample sample;
};

std::string_view textOf(const SharedBytes& bytes) {
  return {reinterpret_cast<const char*>(bytes->data()), bytes->size()};
}

Result<Frame> unpacked(const ros::CompressedImage& image, int bits) {
  const auto pixels = vision::decodeImage(textOf(image.data), std::nullopt, bits);
  if (!pixels) return tl::unexpected(pixels.error());
  Frame frame;
  const auto set = vision::setPixels(frame, *pixels);
  return set ? Result<Frame>(frame) : tl::unexpected(set.error());
}

/// Restores the order in which the messages were written, because the recorder's clock may have
/// been set, too. If most stamps are 0, all messages get their time of recording. Returns the
/// number of changed stamps.
template <class A>
std::size_t orderArrivals(std::vector<A>& arrivals) {
  std::sort(arrivals.begin(), arrivals.end(),
            [](const A& a, const A& b) { return a.place < b.place; });
  const auto unstamped = std::count_if(arrivals.begin(), arrivals.end(),
                                       [](const A& one) { return one.time == TimePoint(); });
  if (2 * static_cast<std::size_t>(unstamped) <= arrivals.size()) return 0;
  for (A& one : arrivals) one.time = fromNanoseconds(static_cast<std::int64_t>(one.log_ns));
  return arrivals.size();
}

/// Reads one camera's images quickly in the order of recording, even if many have the same time of
/// recording. Any other order requires a rewind.
class RosImages {
 public:
  RosImages(const std::filesystem::path& path, CameraTopics topics, int bits)
      : messages_(path), topics_(std::move(topics)), bits_(bits) {
    rewind(0);
  }

  Result<Frame> at(const RosImage& wanted) {
    if (next_ > wanted.number) rewind(wanted.log_ns);
    while (const auto message = messages_.next()) {
      if (message->log_ns > wanted.log_ns) break;
      if (message->place != wanted.place) continue;
      next_ = wanted.number + 1;
      if (topics_.compressed) {
        return messages_.valueOf<ros::CompressedImage>(*message).and_then(
            [this](const auto& image) { return unpacked(image, bits_); });
      }
      return messages_.valueOf<ros::Image>(*message).and_then(
          [this](const auto& image) { return ros::frameOf(image, bits_); });
    }
    next_ = UINT64_MAX;
    return fail("image_missing", topics_.image + " has no image of " +
                                     std::to_string(toNanoseconds(wanted.time)) + " ns any more");
  }

 private:
  void rewind(std::uint64_t from_ns) {
    messages_.rewind({topics_.image}, from_ns);
    next_ = 0;
  }

  RosMessages messages_;
  CameraTopics topics_;
  int bits_;
  std::uint64_t next_ = 0;  ///< images with this number and above are not read yet
};

/// The data of one camera in the recording.
struct RosCamera {
  CameraTopics topics;
  std::vector<RosImage> images = {};
  std::optional<ros::CameraInfo> info = {};  ///< from the first camera_info message
  bool info_changes = false;
  std::string frame_id = {};
  int bits = 8;  ///< used bits of 16, from the brightest image
};

class RosDriveReader {
 public:
  explicit RosDriveReader(const DatasetOptions& options)
      : options_(options), file_(options.path.string()), messages_(options.path) {
    if (!options.rig.empty()) rig_ = readRigParts(options.rig, &recording_.notes);
  }

  Recording read() {
    recording_.kind = DatasetKind::kRosRecording;
    const ChosenTopics chosen = chosenTopics();
    for (const auto& topics : chosen.cameras) addCamera(topics);
    imu_ = chosen.imu;
    readMessages();
    requireImages();
    useArrivals();
    orderImu(recording_, imu_);
    for (std::size_t i = 0; i < cameras_.size(); ++i) addFrames(i);
    sortFrames(recording_);
    for (std::size_t i = 0; i < cameras_.size(); ++i)
      recording_.calibration.cameras.push_back(calibrationOf(i));
    if (!recording_.imu.empty()) recording_.calibration.imu = imuCalibration();
    noteTopics();
    for (const std::string& note : messages_.notes()) recording_.notes.push_back(note);
    return std::move(recording_);
  }

 private:
  /// If a topic is missing in a truncated file, the error names the truncation as its cause.
  ChosenTopics chosenTopics() const {
    const std::string problem = messages_.lastProblem();
    const std::string kept = " holds no topic any more: it is cut off or damaged";
    if (messages_.topics().empty() && !problem.empty()) {
      throw StartupError(ExitCode::kData, file_ + kept + " (" + problem + "); fetch it again");
    }
    try {
      return chooseTopics(messages_.topics(), wantedTopics(), file_);
    } catch (const StartupError& error) {
      if (problem.empty()) throw;
      throw StartupError(ExitCode::kData,
                         error.what() + ("; the file is cut off or damaged: " + problem));
    }
  }

  [[noreturn]] void stop(const std::string& what) const {
    throw StartupError(ExitCode::kUnavailable, file_ + ": " + what);
  }

  std::map<std::string, std::string> wantedTopics() const {
    auto wanted = rig_ ? rig_->topics : std::map<std::string, std::string>();
    for (const auto& [role, topic] : options_.topics) wanted[role] = topic;
    return wanted;
  }

  void addCamera(const CameraTopics& topics) {
    const bool second = !cameras_.empty();
    const bool in_rig = rig_ && rig_->sensors.camera("cam0") != nullptr;
    if (second && in_rig && rig_->sensors.camera("cam1") == nullptr) {
      recording_.notes.push_back(topics.image + " is not used: " + options_.rig.string() +
                                 " has no section cam1");
      return;
    }
    cameras_.push_back({topics});
  }

  void readMessages() {
    std::set<std::string> wanted{kTransforms};
    if (!imu_.empty()) wanted.insert(imu_);
    for (const RosCamera& camera : cameras_) {
      wanted.insert(camera.topics.image);
      if (!camera.topics.info.empty()) wanted.insert(camera.topics.info);
    }
    messages_.rewind(wanted);
    while (const auto message = messages_.next()) take(*message);
    recording_.reasons.add(messages_.reasons());
    if (!messages_.lastProblem().empty()) recording_.notes.push_back(messages_.lastProblem());
  }

  void useArrivals() {
    std::size_t unstamped = orderArrivals(samples_);
    for (RosSample& one : samples_) {
      one.sample.time = one.time;
      recording_.imu.push_back(one.sample);
    }
    samples_ = {};
    for (RosCamera& camera : cameras_) unstamped += orderArrivals(camera.images);
    if (unstamped == 0) return;
    recording_.notes.push_back(file_ + ": " + std::to_string(unstamped) +
                               " messages have no stamp in their header and got the time at which "
                               "they were recorded");
  }

  template <class M>
  std::optional<M> valueIn(const RosMessage& message, const char* kind) {
    auto value = messages_.valueOf<M>(message);
    if (value) return *std::move(value);
    if (message.data.size() > 1 && message.data[0] == '{' && message.data[1] >= '\t')
      json_.insert(message.topic);  // a binary number that begins so has a zero in its next byte
    recording_.reasons.add(std::string(kind) + "_malformed");
    return std::nullopt;
  }

  void take(const RosMessage& message) {
    if (message.topic == kTransforms) {
      if (messages_.topics().at(message.topic).type != ros::TFMessage::kType) return;
      if (const auto value = valueIn<ros::TFMessage>(message, "tf_static")) tree_.add(*value);
    } else if (message.topic == imu_) {
      if (const auto value = valueIn<ros::Imu>(message, "imu")) takeImu(*value, message);
    }
    for (RosCamera& camera : cameras_) {
      if (message.topic == camera.topics.info) takeInfo(camera, message);
      if (message.topic == camera.topics.image) takeImage(camera, message);
    }
  }

  void takeInfo(RosCamera& camera, const RosMessage& message) {
    const auto info = valueIn<ros::CameraInfo>(message, "camera_info");
    if (!camera.info) camera.info = info;
    const auto lensOf = [](const ros::CameraInfo& of) {
      return std::tie(of.width, of.height, of.distortion_model, of.k, of.d, of.p);
    };
    if (!info || camera.info_changes || lensOf(*info) == lensOf(*camera.info)) return;
    camera.info_changes = true;
    recording_.reasons.add("camera_info_changed");
    recording_.notes.push_back(fmt::format(
        "{} changes during the recording: the focal length {:.1f} px becomes {:.1f} px, the size "
        "{}x{} {}x{}. The first is used for all images; fix zoom, focus and resolution, or give a "
        "part of the drive",
        camera.topics.info, camera.info->k[0], info->k[0], camera.info->width, camera.info->height,
        info->width, info->height));
  }

  void takeImu(const ros::Imu& imu, const RosMessage& message) {
    if (imu_frame_.empty()) imu_frame_ = imu.header.frame_id;
    samples_.push_back({arrivalOf(imu.header, message), ros::sampleOf(imu)});
  }

  void takeImage(RosCamera& camera, const RosMessage& message) {
    if (camera.topics.compressed) {
      const auto image = valueIn<ros::CompressedImage>(message, "frame");
      if (!image) return;
      constexpr std::uint64_t kLooks = 16;  // images decoded along the drive
      const std::uint64_t all = messages_.topics().at(message.topic).messages;
      if (camera.bits < 16 && camera.images.size() % std::max<std::uint64_t>(all / kLooks, 1) == 0)
        camera.bits = std::max(camera.bits, vision::usedBitsIn(textOf(image->data)));
      addImage(camera, image->header, message);
    } else if (const auto image = valueIn<ros::Image>(message, "frame")) {
      addImage(camera, image->header, message);
      if (camera.bits < 16) camera.bits = std::max(camera.bits, ros::usedBits(*image));
    }
  }

  void addImage(RosCamera& camera, const ros::Header& header, const RosMessage& message) {
    if (camera.frame_id.empty()) camera.frame_id = header.frame_id;
    camera.images.push_back({arrivalOf(header, message), camera.images.size()});
  }

  static Arrival arrivalOf(const ros::Header& header, const RosMessage& message) {
    return {ros::timeOf(header.stamp), message.log_ns, message.place};
  }

  void requireImages() const {
    if (!cameras_.front().images.empty()) return;
    const std::string& topic = cameras_.front().topics.image;
    if (json_.contains(topic)) stop(topic + jsonText());
    const std::string problem = messages_.lastProblem();
    stop(topic + " has no whole image" + (problem.empty() ? "; record it again" : ": " + problem));
  }

  static std::string jsonText() {
    return " holds JSON text, although the recording declares binary messages of ROS; record the "
           "topic with ros2 bag record, or convert it";
  }

  void addFrames(std::size_t index) {
    RosCamera& camera = cameras_[index];
    orderByTime(camera.images, index == 0 ? "frame" : "stereo", camera.topics.image, recording_);
    const auto store = std::make_shared<RosImages>(options_.path, camera.topics, camera.bits);
    const std::vector<Recording::FrameFile> first = recording_.frames;
    if (index == 0) recording_.frame_count = camera.images.size();
    for (const RosImage& seen : camera.images) {
      Recording::FrameFile frame{seen.time, recording_.frames.size(), index, {}};
      frame.load = [store, seen] { return store->at(seen); };
      if (index > 0 && !pairWith(first, frame, recording_)) continue;
      recording_.frames.push_back(std::move(frame));
    }
  }

  CameraCalibration calibrationOf(std::size_t index) const {
    const std::string name = "cam" + std::to_string(index);
    const CameraCalibration* in_rig = rig_ ? rig_->sensors.camera(name) : nullptr;
    CameraCalibration camera = in_rig ? *in_rig : cameraBy(name, cameras_[index]);
    camera.name = name;
    if (camera.rate_hz <= 0.0) camera.rate_hz = rateOf(recording_.frames, index);
    return camera;
  }

  CameraCalibration cameraBy(const std::string& name, const RosCamera& camera) const {
    const std::string fix = "; write " + name +
                            " into a rig file (`perdure calibrate` makes one) "
                            "and give it with --rig";
    if (!camera.info) {
      stop("no camera_info goes with " + camera.topics.image + ": the lens of " + name +
           " is not known" + damage() + fix);
    }
    auto calibration = ros::cameraOf(*camera.info, camera.topics.rectified);
    if (!calibration) {
      stop(camera.topics.image + ": " + calibration.error().detail + " (on " + camera.topics.info +
           ")" + fix);
    }
    if (imu_.empty()) return *calibration;
    if (json_.contains(imu_)) stop(imu_ + jsonText());
    const std::string& frame =
        camera.frame_id.empty() ? camera.info->header.frame_id : camera.frame_id;
    const auto T_BC = tree_.find(imu_frame_, frame);
    if (!T_BC) {
      stop("where " + name + " (frame `" + frame + "`) is on the inertial unit (frame `" +
           imu_frame_ + "`) is not known: " + whyNoWay() + damage() +
           "; record /tf_static, or write " + name +
           " with T_cam_imu (or T_BS, camera in the IMU's frame) into a rig file and give it with "
           "--rig");
    }
    calibration->T_BC = *T_BC;
    return *calibration;
  }

  std::string whyNoWay() const {
    const auto& refused = tree_.refused();
    if (tree_.empty() && refused.empty()) return "the recording has no /tf_static";
    return "/tf_static has no way between the two frames" +
           (refused.empty() ? "" : ": " + refused.begin()->second);
  }

  /// Returns text about damage that may explain missing data, or "".
  std::string damage() const {
    const std::string problem = messages_.lastProblem();
    return problem.empty() ? "" : "; the file is cut off or damaged: " + problem;
  }

  ImuCalibration imuCalibration() const {
    if (!rig_ || !rig_->sensors.imu) {
      stop("the noise of the inertial unit on " + imu_ +
           " is not known, for ROS' messages do not tell it; write imu0 into a rig file with "
           "gyroscope_noise_density, gyroscope_random_walk, accelerometer_noise_density, "
           "accelerometer_random_walk (its data sheet or Kalibr's imu.yaml has them) and rate_hz, "
           "and give it with --rig");
    }
    return *rig_->sensors.imu;
  }

  void noteTopics() {
    std::string said = file_ + ": ";
    for (std::size_t i = 0; i < cameras_.size(); ++i)
      said += "cam" + std::to_string(i) + " is " + cameras_[i].topics.image + ", ";
    said += imu_.empty() ? "and there is no inertial unit" : "the inertial unit is " + imu_;
    for (const auto& [name, topic] : messages_.topics()) {
      if (imu_.empty() && topic.type.starts_with("sensor_msgs/Imu in ")) {
        said += "; " + name + " has " + topic.type + ", which is not read; convert it";
      }
    }
    if (json_.contains(imu_)) said += "; " + imu_ + jsonText();
    recording_.notes.push_back(said);
  }

  DatasetOptions options_;
  std::string file_;
  RosMessages messages_;
  std::optional<RigParts> rig_;
  Recording recording_;
  std::vector<RosCamera> cameras_;
  std::string imu_, imu_frame_;
  std::set<std::string> json_;  ///< topics with JSON in place of binary messages
  ros::FrameTree tree_;
  std::vector<RosSample> samples_;
};

}  // namespace

Recording readRosDrive(const DatasetOptions& options) { return RosDriveReader(options).read(); }

}  // namespace perdure::replay
