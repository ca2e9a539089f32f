// Messages of simulated ROS 2 drivers on Fast DDS become Perdure's topics. Invalid messages are
// counted, and Health names the fix.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "tests/interop/ros2/bridge_rig.h"
#include "tests/services/run_until.h"

namespace perdure::test {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr std::int64_t kBegin = 1'700'000'000'000'000'000;
constexpr std::int64_t kMs = 1'000'000;

json transforms() {
  const double h = 0.5;
  return lineOf(
      "TFMessage", "/tf_static", 0, 0,
      {{"transforms",
        {{{"parent", "base_link"}, {"child", "imu"}, {"p", {0, 0, 1}}, {"q", {0, 0, 0, 1}}},
         {{"parent", "base_link"},
          {"child", "camera_optical"},
          {"p", {2, 0, 1}},
          {"q", {-h, h, -h, h}}}}}});
}
json info(double after, std::int64_t stamp, int width = 64) {
  return lineOf("CameraInfo", "/camera/camera_info", after, stamp,
                {{"frame", "camera_optical"},
                 {"height", 48},
                 {"width", width},
                 {"model", "plumb_bob"},
                 {"d", {0.01, 0.02, 0, 0, 0}},
                 {"k", {50, 0, 32, 0, 51, 24, 0, 0, 1}}});
}
json image(double after, std::int64_t stamp, int width = 64) {
  return lineOf("Image", "/camera/image_raw", after, stamp,
                {{"frame", "camera_optical"},
                 {"height", 48},
                 {"width", width},
                 {"encoding", "rgb8"},
                 {"step", 3 * width},
                 {"bytes", 48 * 3 * width}});
}
json imu(double after, std::int64_t stamp, json gyro = {0.1, 0.2, 0.3}) {
  return lineOf("Imu", "/imu/data", after, stamp,
                {{"frame", "imu"}, {"gyro", std::move(gyro)}, {"accel", {0, 0, 9.75}}});
}
json odometry(double after, std::int64_t stamp, double x) {
  const double s = std::sqrt(0.5);
  return lineOf("Odometry", "/vio/odometry", after, stamp,
                {{"frame", "odom"},
                 {"child", "base_link"},
                 {"p", {x, 0, 0}},
                 {"q", {0, 0, s, s}},
                 {"linear", {0, -10, 0}}});
}
json boxes(double after, std::int64_t stamp, json detections) {
  return lineOf("Detection2DArray", "/detector/boxes", after, stamp,
                {{"detections", std::move(detections)}});
}

const Settings kAll{"in.cam0.image=/camera/image_raw", "in.imu.topic=/imu/data",
                    "in.odometry.topic=/vio/odometry", "in.detections.topic=/detector/boxes",
                    "in.detections.classes=[car, person]"};

/// Messages received on Perdure's bus.
struct Bus {
  explicit Bus(BridgeRig& rig)
      : frame(rig.participant, bus::frameTopic("cam0")),
        imu(rig.participant, bus::kTopic<ImuSample>),
        calibration(rig.participant, bus::kTopic<Calibration>),
        odometry(rig.participant, bus::kTopic<Odometry>),
        detections(rig.participant, bus::kTopic<Detections>),
        model(rig.participant, bus::kTopic<ModelInfo>) {
    rig.loop.on(frame, [this](const Frame& m) {
      frames.push_back(m);
      frames.back().data =
          std::make_shared<std::vector<std::uint8_t>>((*m.data).begin(), (*m.data).end());
    });
    rig.loop.on(imu, [this](const ImuSample& m) { samples.push_back(m); });
    rig.loop.on(calibration, [this](const Calibration& m) { rigs.push_back(m); });
    rig.loop.on(odometry, [this](const Odometry& m) { poses.push_back(m); });
    rig.loop.on(detections, [this](const Detections& m) { found.push_back(m); });
    rig.loop.on(model, [this](const ModelInfo& m) { models.push_back(m); });
  }
  bus::Reader<Frame> frame;
  bus::Reader<ImuSample> imu;
  bus::Reader<Calibration> calibration;
  bus::Reader<Odometry> odometry;
  bus::Reader<Detections> detections;
  bus::Reader<ModelInfo> model;
  std::vector<Frame> frames;
  std::vector<ImuSample> samples;
  std::vector<Calibration> rigs;
  std::vector<Odometry> poses;
  std::vector<Detections> found;
  std::vector<ModelInfo> models;
};

class Ros2Inwards : public ::testing::TestWithParam<bool> {};

TEST_P(Ros2Inwards, CameraImuOdometryAndDetectionsBecomePerdures) {
  BridgeRig rig;
  rig.startBridge(kAll);
  Bus bus(rig);
  std::vector<json> lines{transforms()};
  // Fast DDS sends latched samples some seconds after a match.
  constexpr int kFrames = 200;
  for (int i = 0; i < kFrames; ++i) {
    const double after = 0.05 * i;
    const std::int64_t stamp = kBegin + i * 50 * kMs;
    lines.push_back(info(after, stamp));
    lines.push_back(imu(after, stamp));
    lines.push_back(odometry(after, stamp - 10 * kMs, 0.5 * i - 0.1));
    lines.push_back(image(after, stamp));
    lines.push_back(boxes(after + 0.02, stamp,
                          {{{"x", 30}, {"y", 20}, {"w", 10}, {"h", 8}, {"scores", {{"car", 0.8}}}},
                           {{"x", 30}, {"y", 20}, {"w", 10}, {"h", 8}, {"scores", {{"1", 0.6}}}}}));
  }
  rig.speak(lines, GetParam());
  const auto all = [&] {
    return bus.found.size() >= 10 && bus.poses.size() >= 10 && bus.samples.size() >= 10 &&
           !bus.rigs.empty() && !bus.models.empty();
  };
  ASSERT_TRUE(runUntil(rig.loop, all, 40s)) << rig.log() << bus.frames.size();

  const CameraCalibration& camera = bus.rigs.back().cameras.at(0);
  EXPECT_EQ(camera.name, "cam0");
  EXPECT_EQ(camera.fx, 50);
  EXPECT_EQ(camera.fy, 51);
  EXPECT_EQ(camera.cx, 32);
  EXPECT_THAT(camera.distortion_coefficients, ElementsAre(0.01, 0.02, 0, 0));
  EXPECT_NEAR(camera.T_BC.p.x(), 2, 1e-9) << "in the IMU's frame, which is the body";
  EXPECT_NEAR(camera.T_BC.p.z(), 0, 1e-9);
  EXPECT_NEAR((camera.T_BC.q * Eigen::Vector3d::UnitZ()).x(), 1, 1e-9) << "it looks ahead";
  EXPECT_NEAR(camera.rate_hz, 20, 0.1);

  const Frame& frame = bus.frames.back();
  EXPECT_EQ(frame.encoding, ImageEncoding::kBgr8);
  EXPECT_EQ(frame.width, 64u);
  EXPECT_EQ((*frame.data).size(), 64u * 48 * 3);
  EXPECT_EQ((*frame.data)[0], 100);
  EXPECT_EQ((toNanoseconds(frame.stamp.time) - kBegin) % (50 * kMs), 0);
  const ImuSample& sample = bus.samples.back();
  EXPECT_EQ(sample.gyro, Eigen::Vector3d(0.1, 0.2, 0.3));
  EXPECT_EQ(sample.accel.z(), 9.75);

  const Odometry& pose = bus.poses.back();
  const double seconds = toSeconds(pose.stamp.time - fromNanoseconds(kBegin));
  EXPECT_NEAR(pose.T_WB.p.x(), 10.0 * seconds, 1e-6) << "between two messages";
  EXPECT_NEAR(pose.T_WB.p.z(), 1, 1e-9) << "the IMU is a metre above base_link";
  EXPECT_NEAR(pose.v_WB.x(), 10, 1e-9) << "said in base_link, which faces left";
  const auto same = [&](const Frame& one) { return one.stamp.sameFrame(pose.stamp); };
  EXPECT_TRUE(std::any_of(bus.frames.begin(), bus.frames.end(), same));

  EXPECT_THAT(bus.models.back().classes, ElementsAre("car", "person"));
  const Detections& found = bus.found.back();
  EXPECT_EQ(found.model_hash, bus.models.back().hash);
  ASSERT_EQ(found.detections.size(), 2u);
  EXPECT_EQ(found.detections[0].box.x1, 25);
  EXPECT_EQ(found.detections[0].box.y2, 24);
  const auto& car = found.detections[0].activations;
  ASSERT_EQ(car.size(), 3u);
  EXPECT_NEAR(car[1], std::log(0.8), 1e-5);
  EXPECT_GT(car[0], car[2]);
  EXPECT_NEAR(found.detections[1].activations[2], std::log(0.6), 1e-5) << "by its number";
  const auto its = [&](const Frame& one) { return one.stamp.sameFrame(found.stamp); };
  EXPECT_TRUE(std::any_of(bus.frames.begin(), bus.frames.end(), its));
}
INSTANTIATE_TEST_SUITE_P(ReliableAndBestEffort, Ros2Inwards, ::testing::Bool());

/// Returns a node of the tree that `perdure status --json` prints, or null if it is missing.
json nodeOf(const json& tree, const std::string& name) {
  if (tree.value("name", "") == name) return tree;
  for (const json& child : tree.value("children", json::array())) {
    if (const json found = nodeOf(child, name); !found.is_null()) return found;
  }
  return nullptr;
}

TEST(Ros2Inwards, StatusSaysThatTheBridgeStandsIn) {
  BridgeRig rig;
  rig.startBridge(kAll);
  Bus bus(rig);
  std::vector<json> lines{transforms()};
  for (int i = 0; i < 500; ++i) {
    const double after = 0.05 * i;
    const std::int64_t stamp = kBegin + i * 50 * kMs;
    lines.push_back(info(after, stamp));
    lines.push_back(imu(after, stamp));
    lines.push_back(odometry(after, stamp - 10 * kMs, 0.5 * i - 0.1));
    lines.push_back(image(after, stamp));
    lines.push_back(boxes(after + 0.02, stamp, json::array()));
  }
  rig.speak(lines);
  ASSERT_TRUE(runUntil(
      rig.loop, [&] { return bus.found.size() > 5 && bus.poses.size() > 5; }, 40s))
      << rig.log();
  Child status({(programs() / "perdure").string(), "status", "--json"}, rig.folder.file("status"));
  int left = -1;
  ASSERT_TRUE(runUntil(
      rig.loop, [&] { return (left = status.wait(1ms)) >= 0; }, 30s));
  const json tree = json::parse(status.log(), nullptr, false);
  ASSERT_TRUE(tree.is_object()) << status.log();
  const std::pair<const char*, const char*> stood_in[] = {
      {"capture", "frame/cam0"}, {"vio", "odometry"}, {"inference", "detections"}};
  for (const auto& [service, topic] : stood_in) {
    const json node = nodeOf(tree, service);
    EXPECT_EQ(node["level"], "ok") << node.dump();
    EXPECT_EQ(node["text"], std::string("ros2 stands in for it: it writes ") + topic);
  }
  EXPECT_EQ(nodeOf(tree, "semantic_filter")["level"], "failed") << "it does not run, and is missed";
  EXPECT_GT(nodeOf(tree, "frame/cam0")["rate_hz"], 5) << "by the bridge's Health";
}

TEST(Ros2InwardsWrong, IsCountedAndSaysTheFix) {
  BridgeRig rig;
  rig.startBridge(kAll);
  Bus bus(rig);
  std::vector<json> lines{transforms()};
  constexpr std::int64_t kOtherClock = 3'600'000'000'000;
  for (int i = 0; i < 200; ++i) {
    const double after = 0.05 * i;
    const std::int64_t stamp = kBegin + i * 50 * kMs;
    lines.push_back(info(after, stamp));
    lines.push_back(image(after, stamp));
    lines.push_back(imu(after, stamp));
    if (i < 20) continue;
    json depth = image(after, stamp + kMs);
    depth["encoding"] = "32FC1";
    json cut = image(after, stamp + 2 * kMs);
    cut["bytes"] = 100;
    json turned = odometry(after, stamp + kMs, 0);
    turned["q"] = {0, 0, 0, 0};
    json lost = odometry(after, stamp + 2 * kMs, 0);
    lost["p"] = {0, "inf", 0};
    json doubtful = odometry(after, stamp + 3 * kMs, 0);
    doubtful["covariance"] = {1, 9, 0, 0, 0, 0, 9, 1};
    const std::vector<json> wrong{
        depth,
        cut,
        image(after, stamp + 3 * kMs, 32),
        image(after, 0),
        image(after, stamp),
        imu(after, stamp + kOtherClock),
        imu(after, stamp + kMs, {"nan", 0, 0}),
        odometry(after, stamp, 0),
        boxes(after, stamp - 100'000 * kMs, json::array()),
        turned,
        lost,
        doubtful,
        odometry(after, stamp + 4 * kMs, 500.0 * i),
        boxes(after, stamp,
              {{{"x", 30}, {"y", 20}, {"w", 0}, {"h", 8}, {"scores", {{"car", 0.8}}}},
               {{"x", "nan"}, {"y", 1}, {"w", 9}, {"h", 8}, {"scores", {{"car", 0.8}}}},
               {{"x", 30}, {"y", 20}, {"w", 9}, {"h", 8}, {"scores", {{"cow", 0.8}}}},
               {{"x", 30}, {"y", 20}, {"w", 9}, {"h", 8}, {"scores", {{"car", 7}}}}})};
    // One message at a time: a full queue drops the oldest message, which would be the same one in
    // each burst.
    lines.push_back(wrong[static_cast<std::size_t>(i) % wrong.size()]);
  }
  rig.speak(lines);
  // A type with the same name but fewer fields.
  rig.speak(
      {lineOf("ShortImu", "/imu/data", 0.5, kBegin), lineOf("ShortImu", "/imu/data", 1.0, kBegin)});
  const std::vector<std::string> reasons{"cam0_image_encoding",      "cam0_image_malformed",
                                         "cam0_image_size",          "cam0_stamp_missing",
                                         "cam0_stamp_not_newer",     "imu_stamp_elsewhere",
                                         "imu_not_finite",           "imu_malformed",
                                         "odometry_no_rotation",     "odometry_not_finite",
                                         "odometry_covariance",      "odometry_jumped",
                                         "detections_of_no_frame",   "detections_box_malformed",
                                         "detections_class_unknown", "detections_score_malformed"};
  const auto counted = [&] {
    return std::all_of(reasons.begin(), reasons.end(),
                       [&](const std::string& reason) { return rig.count(reason) > 0; });
  };
  EXPECT_TRUE(runUntil(rig.loop, counted, 40s)) << rig.log();
  for (const std::string& reason : reasons) EXPECT_GT(rig.count(reason), 0u) << reason;
  EXPECT_FALSE(bus.frames.empty()) << "good ones among them go through";
  EXPECT_FALSE(bus.samples.empty());
  for (const ImuSample& sample : bus.samples)
    EXPECT_LT(toNanoseconds(sample.time), kBegin + kOtherClock / 2);
  EXPECT_FALSE(rig.sentence().empty());
  const std::string log = rig.log();
  EXPECT_THAT(log, HasSubstr("images are `32FC1`; mono8, 8UC1"));
  EXPECT_THAT(log, HasSubstr("stamps of imu are 3600"));
  EXPECT_THAT(log, HasSubstr("set in.imu.clock: own"));
  EXPECT_THAT(log, HasSubstr("the class \"cow\", which in.detections.classes does not list"));
}

TEST(Ros2InwardsWrong, SaysWhatItWaitsForWhereADriverSaysTooLittle) {
  BridgeRig rig;
  rig.startBridge({"in.cam0.image=/camera/image_raw", "in.imu.topic=/imu/data"});
  Bus bus(rig);
  std::vector<json> lines;
  for (int i = 0; i < 100; ++i) {
    lines.push_back(image(0.05 * i, kBegin + i * 50 * kMs));
    lines.push_back(imu(0.05 * i, kBegin + i * 50 * kMs));
  }
  rig.speak(lines);
  EXPECT_TRUE(runUntil(rig.loop, [&] {
    return rig.sentence().find("waits for a CameraInfo of cam0 on /camera/camera_info") !=
           std::string::npos;
  })) << rig.log();
  std::vector<json> infos;
  for (int i = 0; i < 40; ++i) infos.push_back(info(0.1 * i, kBegin + i * 100 * kMs));
  rig.speak(infos);
  EXPECT_TRUE(runUntil(rig.loop, [&] {
    return rig.sentence().find("no way between the two is on /tf_static") != std::string::npos;
  })) << rig.log();
  EXPECT_TRUE(bus.rigs.empty());
  rig.speak({transforms()});
  EXPECT_TRUE(runUntil(rig.loop, [&] { return !bus.rigs.empty(); })) << rig.log();
}

TEST(Ros2InwardsClock, ADriverWithAClockOfItsOwnIsPlacedByWhenItSpeaks) {
  BridgeRig rig;
  Settings settings = kAll;
  settings.push_back("in.imu.clock=own");
  rig.startBridge(settings);
  Bus bus(rig);
  std::vector<json> lines{transforms()};
  constexpr std::int64_t kItsOwn = 42'000 * kMs;
  for (int i = 0; i < 400; ++i) {  // 12 s, because latched transforms arrive some seconds after a
                                   // match
    lines.push_back(info(0.03 * i, kBegin + i * 30 * kMs));
    lines.push_back(image(0.03 * i, kBegin + i * 30 * kMs));
    lines.push_back(imu(0.03 * i, kItsOwn + i * 30 * kMs));
  }
  rig.speak(lines);
  ASSERT_TRUE(runUntil(
      rig.loop, [&] { return bus.samples.size() >= 20 && !bus.frames.empty(); }, 40s))
      << rig.log();
  const double i = static_cast<double>(bus.samples.back().sequence);
  EXPECT_GT(i, 10);
  const double off = toSeconds(bus.samples.back().time - bus.frames.back().stamp.time);
  EXPECT_LT(std::abs(off), 1.0) << "on the camera's clock, but for delays";
  EXPECT_GT(rig.count("imu_clock_unknown"), 0u) << "in the first half second";
}

}  // namespace
}  // namespace perdure::test
