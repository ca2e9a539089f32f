// Simulated ROS 2 nodes (camera, IMU, a detector) play a drive through the bridge, and vio and the
// filter map its objects. Fast DDS stands in for ROS; all other programs are the real ones.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <map>
#include <sstream>

#include "common/replay/dataset.h"
#include "tests/interop/ros2/bridge_rig.h"
#include "tests/services/run_until.h"

namespace perdure::test {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using nlohmann::json;
using replay::Dataset;

/// Returns the boxes of visible objects by frame, as a detector would report them.
std::map<std::uint64_t, json> boxesOf(const fs::path& drive) {
  std::ifstream truth(drive / "objects_truth.json"), seen(drive / "visibility_truth.csv");
  const json objects = json::parse(truth);
  std::map<int, std::string> classes;
  for (const json& one : objects["objects"]) classes[one["id"]] = one["class"];
  std::map<std::uint64_t, json> by_frame;
  std::string line;
  std::getline(seen, line);
  while (std::getline(seen, line)) {
    std::uint64_t frame = 0;
    int id = 0;
    double fraction = 0, x1 = 0, y1 = 0, x2 = 0, y2 = 0;
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream(line) >> frame >> id >> fraction >> x1 >> y1 >> x2 >> y2;
    if (fraction < 0.7 || y2 - y1 < 12) continue;
    by_frame[frame].push_back({{"x", (x1 + x2) / 2},
                               {"y", (y1 + y2) / 2},
                               {"w", x2 - x1},
                               {"h", y2 - y1},
                               {"scores", {{classes[id], 0.9}}}});
  }
  return by_frame;
}

/// Fast DDS sends latched samples some seconds after a match. During a rest before the drive, its
/// first image and sample are repeated.
constexpr double kLatched = 4.0, kRest = 1.5;

class Script {
 public:
  Script(const fs::path& drive, fs::path images)
      : dataset_(Dataset::open({.path = drive})),
        camera_(dataset_->calibration().cameras.at(0)),
        images_(std::move(images)),
        boxes_(boxesOf(drive)) {
    fs::create_directories(images_);
    addTransform();
    while (const auto message = dataset_->next()) {
      if (const auto* sample = std::get_if<ImuSample>(&*message)) add(*sample);
      if (const auto* frame = std::get_if<Frame>(&*message)) add(*frame);
    }
    std::stable_sort(lines_.begin(), lines_.end(), [](const json& a, const json& b) {
      return a["after"].get<double>() < b["after"].get<double>();
    });
  }
  const std::vector<json>& lines() const { return lines_; }

 private:
  void addTransform() {
    const auto& T = camera_.T_BC;
    lines_.push_back(lineOf("TFMessage", "/tf_static", 0, 0,
                            {{"transforms",
                              {{{"parent", "imu"},
                                {"child", "camera_optical"},
                                {"p", {T.p.x(), T.p.y(), T.p.z()}},
                                {"q", {T.q.x(), T.q.y(), T.q.z(), T.q.w()}}}}}}));
  }
  void add(const ImuSample& sample) {
    if (samples_++ == 0) {
      for (double before = kRest; before > 0.0025; before -= 0.005) say(sample, -before);
    }
    say(sample, 0);
  }
  void add(const Frame& frame) {
    std::ofstream(fileOf(frame), std::ios::binary)
        .write(reinterpret_cast<const char*>((*frame.data).data()),
               static_cast<std::streamsize>((*frame.data).size()));
    if (frame.stamp.sequence == 0) {
      for (double before = kRest; before > 0.05; before -= 0.1) say(frame, -before);
    }
    say(frame, 0);
  }
  std::string fileOf(const Frame& frame) const {
    return (images_ / std::to_string(frame.stamp.sequence)).string();
  }
  double after(std::int64_t ns) {
    if (!begin_) begin_ = ns;
    return kLatched + kRest + static_cast<double>(ns - *begin_) * 1e-9;
  }
  void say(const ImuSample& sample, double later) {
    const std::int64_t ns = toNanoseconds(sample.time);
    const auto& [w, a] = std::pair(sample.gyro, sample.accel);
    lines_.push_back(lineOf(
        "Imu", "/imu/data", after(ns) + later, ns + shift(later),
        {{"frame", "imu"}, {"gyro", {w.x(), w.y(), w.z()}}, {"accel", {a.x(), a.y(), a.z()}}}));
  }
  void say(const Frame& frame, double later) {
    const std::int64_t ns = toNanoseconds(frame.stamp.time);
    const double when = after(ns) + later;
    const std::int64_t stamp = ns + shift(later);
    lines_.push_back(
        lineOf("CameraInfo", "/camera/camera_info", when, stamp,
               {{"frame", "camera_optical"},
                {"height", camera_.height},
                {"width", camera_.width},
                {"model", "plumb_bob"},
                {"d", camera_.distortion_coefficients},
                {"k", {camera_.fx, 0, camera_.cx, 0, camera_.fy, camera_.cy, 0, 0, 1}}}));
    const auto channels = channelsOf(frame.encoding);
    lines_.push_back(lineOf("Image", "/camera/image_raw", when, stamp,
                            {{"frame", "camera_optical"},
                             {"height", frame.height},
                             {"width", frame.width},
                             {"encoding", channels == 3 ? "bgr8" : "mono8"},
                             {"step", frame.width * channels},
                             {"file", fileOf(frame)}}));
    const auto found = boxes_.find(frame.stamp.sequence);
    lines_.push_back(
        lineOf("Detection2DArray", "/detector/boxes", when + 0.03, stamp,
               {{"detections", found == boxes_.end() ? json::array() : found->second}}));
  }
  static std::int64_t shift(double seconds) { return std::llround(seconds * 1e9); }

  std::unique_ptr<Dataset> dataset_;
  const CameraCalibration camera_;
  const fs::path images_;
  const std::map<std::uint64_t, json> boxes_;
  std::vector<json> lines_;
  std::optional<std::int64_t> begin_;
  std::size_t samples_ = 0;
};

TEST(Ros2Drive, CameraImuAndDetectorOfRosMakeAMapWithObjects) {
  BridgeRig rig;
  const fs::path drive = rig.folder.file("street");
  Child simulate({(programs() / "perdure").string(), "simulate", "--scene", "street", "--seconds",
                  "6", "--rate", "10", "--size", "320x240", "--quiet", "--out", drive.string()},
                 rig.folder.file("simulate"));
  ASSERT_EQ(simulate.wait(150s), 0) << simulate.log();
  const Script script(drive, rig.folder.file("images"));
  rig.startBridge({"in.cam0.image=/camera/image_raw", "in.imu.topic=/imu/data",
                   "in.detections.topic=/detector/boxes", "in.detections.boxes=cuboid",
                   "in.detections.classes=[car, truck, bus, van, person, bicycle, motorcycle, "
                   "pedestrian, cyclist, tree, pole, sign]"});
  const Child vio({(programs() / "perdure-vio").string(), "--config",
                   (sources() / "config/vio.yaml").string(), "--set", "state.directory=\"\""},
                  rig.folder.file("vio"));
  const Child filter({(programs() / "perdure-semantic-filter").string(), "--set",
                      "class_priors=" + (sources() / "config/class_priors.yaml").string(), "--set",
                      "restore.timeout_s=0.2"},
                     rig.folder.file("filter"));
  rig.listen({"/perdure/objects", "/perdure/odometry"});
  bus::Reader<Objects> objects(rig.participant, bus::kTopic<Objects>);
  bus::Reader<Odometry> odometry(rig.participant, bus::kTopic<Odometry>);
  std::size_t frames = 0, most = 0, poses = 0;
  double way = 0;
  rig.loop.on(objects, [&](const Objects& m) {
    ++frames;
    most = std::max<std::size_t>(
        most, static_cast<std::size_t>(std::count_if(m.objects.begin(), m.objects.end(),
                                                     [](const auto& o) { return o.confirmed; })));
  });
  rig.loop.on(odometry, [&](const Odometry& m) {
    poses += m.state == OdometryState::kTracking;
    way = std::max(way, m.T_WB.p.norm());
  });
  // Waits until the outputs of the filter and of vio are matched, before the drive begins.
  ASSERT_TRUE(runUntil(rig.loop, [&] { return objects.matched() > 0 && odometry.matched() > 0; }));
  rig.speak(script.lines(), true);
  EXPECT_TRUE(runUntil(
      rig.loop, [&] { return rig.said(); }, 90s))
      << rig.log();
  const auto end = std::chrono::steady_clock::now() + 1s;
  while (std::chrono::steady_clock::now() < end) rig.loop.runOnce(20ms);
  EXPECT_GE(frames, 30u) << rig.log() << vio.log() << filter.log();
  EXPECT_GE(poses, 20u) << vio.log();
  EXPECT_GE(most, 3u) << filter.log();
  EXPECT_GT(way, 5.0) << "metres, of a street that is driven through";
  std::size_t shown = 0;
  const auto heard = rig.heard();
  ASSERT_TRUE(heard.contains("/perdure/objects")) << rig.log();
  for (const json& message : heard.at("/perdure/objects"))
    shown = std::max(shown, message["detections"].size());
  EXPECT_EQ(shown, most) << "and a node of ROS sees the map";
}

}  // namespace
}  // namespace perdure::test
