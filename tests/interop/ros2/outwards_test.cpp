// Checks every topic that the bridge writes, as a ROS 2 node receives it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/interop/ros2/bridge_rig.h"
#include "tests/services/run_until.h"
#include "tests/support/camera.h"

namespace perdure::test {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;
using ::testing::HasSubstr;

constexpr std::int64_t kStart = 1'700'000'000'000'000'000;
constexpr std::int64_t kFrame = 100'000'000;

ObjectBelief carAt(const Eigen::Vector3d& p) {
  ObjectBelief object;
  object.id = 12;
  object.existence = 0.8;
  object.confirmed = true;
  object.classes.resize(2);
  object.classes[0].name = "car";
  object.classes[0].probability = 0.75;
  object.classes[1].name = kOtherClass;
  object.classes[1].probability = 0.25;
  for (ClassBelief& belief : object.classes) {
    belief.mean << p, 0.0, std::log(4.0), std::log(1.8), std::log(1.5);
    belief.covariance = 0.04 * Matrix7d::Identity();
  }
  object.visible_fraction = 1;
  return object;
}

/// Publishes all messages that Perdure's services would send for one frame.
class Vehicle {
 public:
  explicit Vehicle(BridgeRig& rig) : participant_(rig.participant) {
    Calibration c;
    c.source = 77;
    c.cameras = {tests::cameraAhead(64, 48, 50)};
    c.imu = ImuCalibration{.gyro_noise = 1e-3, .rate_hz = 100};
    (void)calibration_.write(c);
    ModelInfo model;
    model.hash = 5;
    model.classes = {"car", "person"};
    (void)model_.write(model);
    MapFrame map;
    map.world = {5, 0};
    map.T_MW.p = {100, 0, 0};
    (void)map_.write(map);
  }
  void sayFrame() {
    const FrameStamp stamp{77, next_,
                           fromNanoseconds(kStart + kFrame * static_cast<std::int64_t>(next_)), 1};
    ++next_;
    Frame frame{stamp,
                "cam0",
                64,
                48,
                ImageEncoding::kMono8,
                std::make_shared<std::vector<std::uint8_t>>(64 * 48, std::uint8_t{7})};
    (void)frame_.write(frame);
    (void)imu_.write(ImuSample{77, next_, stamp.time, {0.1, 0.2, 0.3}, {0, 0, 9.75}});
    Odometry pose;
    pose.stamp = stamp;
    pose.instance = 78;
    pose.world = {5, 0};
    pose.state = OdometryState::kTracking;
    pose.T_WB = {Eigen::Quaterniond(std::sqrt(0.5), 0, 0, std::sqrt(0.5)),
                 Eigen::Vector3d(1, 2, 3)};
    pose.v_WB = {0, 4, 0};
    pose.covariance.diagonal().setConstant(0.01);
    (void)odometry_.write(pose);
    Landmarks points{stamp, 78, {5, 0}, "cam0", {}};
    points.landmarks.resize(2);
    points.landmarks[1].p_W = {1.5, -2.5, 3.5};
    points.landmarks[1].covariance = 0.25 * Eigen::Matrix3d::Identity();
    (void)landmarks_.write(points);
    Detections found{stamp, "cam0", 79, 5, {}};
    found.detections.resize(1);
    found.detections[0].box = {10, 20, 30, 44};
    found.detections[0].activations = {std::log(0.1F), std::log(0.7F), std::log(0.2F)};
    (void)detections_.write(found);
    Objects objects;
    objects.stamp = stamp;
    objects.world = {5, 0};
    objects.objects = {carAt({10, 0, 0.75})};
    (void)objects_.write(objects);
  }
  std::size_t readersOfFrames() const { return frame_.matched(); }

 private:
  const bus::Participant& participant_;
  std::uint64_t next_ = 1;
  bus::Writer<Calibration> calibration_{participant_, bus::kTopic<Calibration>};
  bus::Writer<ModelInfo> model_{participant_, bus::kTopic<ModelInfo>};
  bus::Writer<MapFrame> map_{participant_, bus::kTopic<MapFrame>};
  bus::Writer<Frame> frame_{participant_, bus::frameTopic("cam0")};
  bus::Writer<ImuSample> imu_{participant_, bus::kTopic<ImuSample>};
  bus::Writer<Odometry> odometry_{participant_, bus::kTopic<Odometry>};
  bus::Writer<Landmarks> landmarks_{participant_, bus::kTopic<Landmarks>};
  bus::Writer<Detections> detections_{participant_, bus::kTopic<Detections>};
  bus::Writer<Objects> objects_{participant_, bus::kTopic<Objects>};
};

/// Publishes frames until every topic has been received; returns the newest message of each.
std::map<std::string, json> newestOfAll(BridgeRig& rig, Vehicle& vehicle, std::size_t topics) {
  std::map<std::string, json> newest;
  for (int i = 0; i < 400 && newest.size() < topics; ++i) {
    vehicle.sayFrame();
    const auto end = std::chrono::steady_clock::now() + 50ms;
    while (std::chrono::steady_clock::now() < end) rig.loop.runOnce(5ms);
    for (auto& [topic, messages] : rig.heard()) newest[topic] = messages.back();
  }
  return newest;
}

TEST(Ros2Outwards, EveryTopicIsReceivedWithItsValues) {
  BridgeRig rig;
  rig.startBridge({"out.clock=true"});
  Vehicle vehicle(rig);
  rig.listen();
  auto all = newestOfAll(rig, vehicle, 14);
  ASSERT_EQ(all.size(), 14u) << rig.log();

  const json& image = all["/perdure/cam0/image_raw"];
  EXPECT_EQ(image["encoding"], "mono8");
  EXPECT_EQ(image["width"], 64);
  EXPECT_EQ(image["height"], 48);
  EXPECT_EQ(image["step"], 64);
  EXPECT_EQ(image["sum"], 7 * 64 * 48);
  EXPECT_EQ(image["header"]["frame"], "cam0_optical");
  EXPECT_EQ((image["header"]["stamp"].get<std::int64_t>() - kStart) % kFrame, 0);
  const json& packed = all["/perdure/cam0/image_raw/compressed"];
  EXPECT_EQ(packed["jpeg"], true) << "made of a raw frame, for someone wants it";
  EXPECT_EQ(packed["format"], "mono8; jpeg compressed mono8");
  const json& info = all["/perdure/cam0/camera_info"];
  EXPECT_EQ(info["model"], "plumb_bob");
  EXPECT_EQ(info["k"][0], 50);
  EXPECT_EQ(info["width"], 64);

  const json& imu = all["/perdure/imu"];
  EXPECT_EQ(imu["gyro"], json({0.1, 0.2, 0.3}));
  EXPECT_EQ(imu["accel"][2], 9.75);
  EXPECT_EQ(imu["orientation_covariance"], -1);
  EXPECT_EQ(imu["header"]["frame"], "imu_link");
  const json& odometry = all["/perdure/odometry"];
  EXPECT_EQ(odometry["header"]["frame"], "odom");
  EXPECT_EQ(odometry["child"], "base_link");
  EXPECT_EQ(odometry["pose"]["p"], json({1, 2, 3}));
  EXPECT_NEAR(odometry["linear"][0].get<double>(), 4.0, 1e-12) << "in the body, which faces left";
  EXPECT_NEAR(odometry["angular"][2].get<double>(), 0.3, 1e-12);
  EXPECT_NEAR(odometry["covariance"][0].get<double>(), 0.01, 1e-12);
  for (const int i : {21, 28, 35})
    EXPECT_NEAR(odometry["twist_covariance"][i].get<double>(), 1e-4, 1e-12) << "of the gyroscope";

  EXPECT_EQ((all["/clock"]["clock"].get<std::int64_t>() - kStart) % kFrame, 0);

  const json& tf = all["/tf"]["transforms"];
  ASSERT_EQ(tf.size(), 2u);
  EXPECT_EQ(tf[0]["header"]["frame"], "map");
  EXPECT_EQ(tf[0]["child"], "odom");
  EXPECT_EQ(tf[0]["p"][0], 100);
  EXPECT_EQ(tf[1]["child"], "base_link");
  EXPECT_EQ(tf[1]["p"], json({1, 2, 3}));
  EXPECT_NEAR(tf[1]["q"][2].get<double>(), std::sqrt(0.5), 1e-12);
  ASSERT_EQ(all["/tf_static"]["transforms"].size(), 3u);
  EXPECT_EQ(all["/tf_static"]["transforms"][2]["child"], "cam0_optical");

  const json& cloud = all["/perdure/landmarks"];
  EXPECT_EQ(cloud["fields"], json({"x", "y", "z", "intensity"}));
  EXPECT_EQ(cloud["width"], 2);
  float point[4];
  const auto bytes = cloud["data"].get<std::vector<std::uint8_t>>();
  ASSERT_EQ(bytes.size(), 32u);
  std::memcpy(point, bytes.data() + 16, 16);
  EXPECT_EQ(point[0], 1.5F);
  EXPECT_EQ(point[1], -2.5F);
  EXPECT_EQ(point[3], 0.5F);

  EXPECT_EQ(all["/perdure/obstacles"]["header"]["frame"], "odom");
  EXPECT_GT(all["/perdure/obstacles"]["width"], 500) << "the sides of one car";

  const json& found = all["/perdure/detections"]["detections"];
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0]["x"], 20);
  EXPECT_EQ(found[0]["y"], 32);
  EXPECT_EQ(found[0]["w"], 20);
  EXPECT_EQ(found[0]["h"], 24);
  EXPECT_EQ(found[0]["results"][0]["class"], "car");
  EXPECT_NEAR(found[0]["results"][0]["score"].get<double>(), 0.7, 1e-6);

  const json& things = all["/perdure/objects"]["detections"];
  ASSERT_EQ(things.size(), 1u);
  EXPECT_EQ(things[0]["id"], "12");
  EXPECT_EQ(things[0]["results"][0]["class"], "car");
  EXPECT_NEAR(things[0]["results"][0]["score"].get<double>(), 0.6, 1e-6);
  EXPECT_NEAR(things[0]["results"][0]["variance_x"].get<double>(), 0.04, 1e-6);
  EXPECT_NEAR(things[0]["size"][0].get<double>(), 4.0, 1e-5);
  EXPECT_NEAR(things[0]["center"]["p"][0].get<double>(), 10.0, 1e-6);
  const json& markers = all["/perdure/markers"]["markers"];
  ASSERT_EQ(markers.size(), 4u);
  EXPECT_EQ(markers[0]["action"], 3);
  EXPECT_EQ(markers[1]["type"], 1);
  EXPECT_EQ(markers[1]["ns"], "car");
  EXPECT_GE(markers[2]["points"], 24);
  EXPECT_THAT(markers[3]["text"].get<std::string>(), HasSubstr("car"));
  const json& status = all["/perdure/diagnostics"]["status"][0];
  EXPECT_EQ(status["name"], "perdure/ros2");
  EXPECT_EQ(status["level"], 0);
  EXPECT_TRUE(status["values"].contains("cpu_s"));
}

TEST(Ros2Outwards, AutowareHearsTrackedObjectsWhereItIsTold) {
  const std::string topic = "/perception/object_recognition/tracking/objects";
  BridgeRig rig;
  rig.startBridge({"out.tracked_objects=" + topic});
  Vehicle vehicle(rig);
  rig.listen({topic});
  auto all = newestOfAll(rig, vehicle, 1);
  ASSERT_EQ(all.size(), 1u) << rig.log();
  EXPECT_EQ(all[topic]["header"]["frame"], "map");
  const json& objects = all[topic]["objects"];
  ASSERT_EQ(objects.size(), 1u);
  const json& car = objects[0];
  EXPECT_EQ(car["uuid"], json({0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 12}));
  EXPECT_NEAR(car["existence"].get<double>(), 0.8, 1e-6);
  ASSERT_EQ(car["classification"].size(), 2u);
  EXPECT_EQ(car["classification"][0][0], 1) << "CAR";
  EXPECT_NEAR(car["classification"][0][1].get<double>(), 0.75, 1e-6);
  EXPECT_EQ(car["classification"][1][0], 0) << "UNKNOWN";
  EXPECT_NEAR(car["pose"]["p"][0].get<double>(), 110.0, 1e-6) << "W lies 100 m ahead in M";
  EXPECT_NEAR(car["covariance"][0].get<double>(), 0.04, 1e-9);
  EXPECT_NEAR(car["covariance"][35].get<double>(), 0.04, 1e-9) << "the yaw's, about z";
  EXPECT_EQ(car["orientation"], 1) << "front and back are not told apart while it stands";
  EXPECT_EQ(car["stationary"], true);
  EXPECT_EQ(car["type"], 0);
  EXPECT_NEAR(car["size"][0].get<double>(), 4.0, 1e-5);
  EXPECT_NEAR(car["size"][2].get<double>(), 1.5, 1e-5);
}

TEST(Ros2Outwards, ReadsImagesOnlyWhileSomebodyOfRosDoes) {
  BridgeRig rig;
  rig.startBridge({});
  Vehicle vehicle(rig);
  rig.listen({"/perdure/objects"});
  ASSERT_EQ(newestOfAll(rig, vehicle, 1).size(), 1u) << rig.log();
  EXPECT_EQ(vehicle.readersOfFrames(), 0u);
  rig.listen({"/perdure/cam0/image_raw"});
  ASSERT_EQ(newestOfAll(rig, vehicle, 1).size(), 1u) << rig.log();
  EXPECT_EQ(vehicle.readersOfFrames(), 1u);
  rig.listen({"/perdure/objects"});  // the previous listener ends
  EXPECT_TRUE(runUntil(
      rig.loop, [&] { return vehicle.readersOfFrames() == 0; }, 40s))
      << rig.log();
}

TEST(Ros2Outwards, LeavesTfToOthersWhereItIsTold) {
  BridgeRig rig;
  rig.startBridge({"out.tf=false", "out.prefix=/here"});
  Vehicle vehicle(rig);
  rig.listen();
  for (int i = 0; i < 60; ++i) {
    vehicle.sayFrame();
    rig.loop.runOnce(50ms);
  }
  EXPECT_TRUE(rig.heard().empty()) << rig.log();
}

}  // namespace
}  // namespace perdure::test
