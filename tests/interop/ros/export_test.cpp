// Checks recordings of `perdure record export --ros2`, as npm's @mcap/core and
// @foxglove/rosmsg2-serialization read them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <sstream>

#include "common/replay/recordings/recording_writer.h"
#include "tests/interop/ros/strangers.h"
#include "tools/record/files.h"

namespace perdure::test {
namespace {

/// Messages of a possible run of the services, with simple numbers.
struct Said {
  Said() {
    calibration.cameras.resize(1);
    CameraCalibration& camera = calibration.cameras[0];
    camera.name = "cam0";
    camera.width = 4, camera.height = 2;
    camera.fx = 20, camera.fy = 21, camera.cx = 2, camera.cy = 1;
    camera.distortion = DistortionModel::kRadialTangential;
    camera.distortion_coefficients = {-0.28, 0.07, 0.001, 0.002};
    // The camera looks along the body's x axis, 1.5 m above it.
    camera.T_BC = {Eigen::Quaterniond(0.5, -0.5, 0.5, -0.5), {0.2, 0.0, 1.5}};
    calibration.imu = ImuCalibration{0.01, 1e-4, 0.1, 1e-3, 100.0};
    stamp = {7, 3, fromNanoseconds(kSensorNs), 0};
    imu.time = stamp.time;
    imu.gyro = {0.1, 0.2, 0.3}, imu.accel = {0.5, 0.0, 9.81};
    frame.stamp = stamp;
    frame.camera = "cam0";
    frame.width = 4, frame.height = 2;
    frame.data = std::make_shared<const std::vector<std::uint8_t>>(
        std::vector<std::uint8_t>{1, 2, 3, 4, 5, 6, 7, 8});
    packed = frame;
    packed.encoding = ImageEncoding::kJpegBgr8;
    odometry.stamp = stamp;
    odometry.state = OdometryState::kTracking;
    odometry.world = {5, 0};
    odometry.T_WB = {Eigen::Quaterniond(Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitZ())),
                     {10, 20, 0}};
    odometry.v_WB = {0, 3, 0};  // forwards
    odometry.covariance.diagonal() << .01, .02, .03, .1, .2, .3, 1, 2, 3;
    map_frame.world = odometry.world;
    map_frame.T_MW.p = {100, 0, 0};
    landmarks.stamp = stamp;
    landmarks.camera = "cam0";
    landmarks.landmarks.resize(2);
    landmarks.landmarks[1].p_W = {1.5, 2.5, 3.5};
    landmarks.landmarks[1].covariance = 0.25 * Eigen::Matrix3d::Identity();
    model.hash = 9;
    model.classes = {"car", "person"};
    detections.stamp = stamp;
    detections.camera = "cam0";
    detections.model_hash = 9;
    detections.detections.resize(2);
    detections.detections[0].box = {10, 20, 30, 60};
    detections.detections[0].activations = {0, std::log(6.f), std::log(3.f)};
    detections.detections[1] = detections.detections[0];
    detections.detections[1].primed = true;
    detections.detections[1].primed_for = 12;
    objects.stamp = stamp;
    for (const ObjectId id : {12u, 13u, 14u}) objects.objects.push_back(objectOf(id));
    objects.objects[1].visibility = Visibility::kOccluded;
    objects.objects[2].confirmed = false;
    health.process = "vio";
    health.state = HealthState::kDegraded;
    health.message = "no inertial samples";
    health.reasons["imu_gap"] = 4;
  }

  static ObjectBelief objectOf(ObjectId id) {
    ObjectBelief object;
    object.id = id;
    object.existence = 0.8;
    object.confirmed = true;
    ClassBelief car;
    car.name = "car";
    car.probability = 0.75;
    car.mean << 5, 6, 0.75, M_PI / 2, std::log(4.0), std::log(2.0), std::log(1.5);
    car.covariance.diagonal() << .1, .2, .3, .04, 1, 1, 1;
    car.covariance(0, 3) = car.covariance(3, 0) = 0.01;
    ClassBelief van = car;
    van.name = "van", van.probability = 0.25, van.mean[0] = 5.5;
    object.classes = {car, van};
    return object;
  }

  void write(const std::string& file) const {
    replay::RecordingWriter recording(file);
    std::uint64_t log = 1'700'000'000'000'000'000;
    const auto add = [&](const char* topic, const auto& value) {
      const auto added = recording.add(topic, value, ++log);
      EXPECT_TRUE(added) << topic << ": " << (added ? "" : added.error().detail);
    };
    add("calibration", calibration), add("imu", imu), add("frame/cam0", frame);
    add("frame/cam0", packed), add("map/frame", map_frame), add("odometry", odometry);
    add("landmarks", landmarks), add("detections", detections), add("model", model);
    add("objects", objects), add("health", health);
    recording.finish();
  }

  static constexpr std::int64_t kSensorNs = 12'250'000'001;
  FrameStamp stamp;
  Calibration calibration;
  ImuSample imu;
  Frame frame, packed;
  Odometry odometry;
  MapFrame map_frame;
  Landmarks landmarks;
  ModelInfo model;
  Detections detections;
  Objects objects;
  Health health;
};

using nlohmann::json;

class Ros2Export : public testing::Test {
 protected:
  void SetUp() override {
    if (!Npm::one().whyNot().empty()) GTEST_SKIP() << Npm::one().whyNot();
    if (!file_.is_null()) return;
    const Folder place;
    Said().write(place.file("run.mcap"));
    EXPECT_TRUE(tools::exportRos2(place.file("run.mcap"), place.file("ros2.mcap")).all().empty());
    std::istringstream lines(Npm::one().run({"read_ros2.mjs", place.file("ros2.mcap")}));
    for (std::string line; std::getline(lines, line);) {
      const json value = json::parse(line);
      if (value.contains("topic")) {
        said_[value["topic"]].push_back(value["value"]);
      } else {
        file_ = value;
      }
    }
  }

  static json last(const std::string& topic) {
    const auto& all = said_[topic];
    return all.empty() ? json() : all.back();
  }

  static inline json file_;
  static inline std::map<std::string, std::vector<json>> said_;
};

TEST_F(Ros2Export, HasTheProfileTheTypesAndTheDefinitionsOfRos2) {
  EXPECT_EQ(file_["profile"], "ros2");
  EXPECT_EQ(file_["wrong"], json::array());
  const std::map<std::string, std::string> types = {
      {"/perdure/objects", "vision_msgs/msg/Detection3DArray"},
      {"/perdure/detections", "vision_msgs/msg/Detection2DArray"},
      {"/perdure/markers", "visualization_msgs/msg/MarkerArray"},
      {"/perdure/odometry", "nav_msgs/msg/Odometry"},
      {"/tf", "tf2_msgs/msg/TFMessage"},
      {"/tf_static", "tf2_msgs/msg/TFMessage"},
      {"/perdure/cam0/image_raw", "sensor_msgs/msg/Image"},
      {"/perdure/cam0/image_raw/compressed", "sensor_msgs/msg/CompressedImage"},
      {"/perdure/cam0/camera_info", "sensor_msgs/msg/CameraInfo"},
      {"/perdure/imu", "sensor_msgs/msg/Imu"},
      {"/perdure/landmarks", "sensor_msgs/msg/PointCloud2"},
      {"/perdure/diagnostics", "diagnostic_msgs/msg/DiagnosticArray"}};
  EXPECT_EQ(file_["channels"].size(), types.size());
  for (const auto& [topic, type] : types) {
    const json& channel = file_["channels"][topic];
    EXPECT_EQ(channel["type"], type) << topic;
    EXPECT_EQ(channel["encoding"], "ros2msg");
    EXPECT_EQ(channel["latched"], topic == "/tf_static" || topic.ends_with("camera_info")) << topic;
  }
}

TEST_F(Ros2Export, SensorsAreAsTheyWere) {
  const json image = last("/perdure/cam0/image_raw");
  EXPECT_EQ(image["header"]["stamp"]["sec"], 12);
  EXPECT_EQ(image["header"]["stamp"]["nanosec"], 250'000'001);
  EXPECT_EQ(image["header"]["frame_id"], "cam0_optical");
  EXPECT_EQ(image["encoding"], "mono8");
  EXPECT_EQ(image["data"], json({1, 2, 3, 4, 5, 6, 7, 8}));
  EXPECT_EQ(last("/perdure/cam0/image_raw/compressed")["format"], "bgr8; jpeg compressed bgr8");
  const json info = last("/perdure/cam0/camera_info");
  EXPECT_EQ(info["distortion_model"], "plumb_bob");
  EXPECT_EQ(info["d"], json({-0.28, 0.07, 0.001, 0.002, 0.0}));
  EXPECT_EQ(info["k"], json({20.0, 0.0, 2.0, 0.0, 21.0, 1.0, 0.0, 0.0, 1.0}));
  const json imu = last("/perdure/imu");
  EXPECT_EQ(imu["linear_acceleration"]["z"], 9.81);
  EXPECT_EQ(imu["orientation_covariance"][0], -1.0);
  EXPECT_NEAR(imu["angular_velocity_covariance"][4].get<double>(), 0.01, 1e-12);
}

double yawOf(const json& q) { return 2 * std::atan2(q["z"].get<double>(), q["w"].get<double>()); }

TEST_F(Ros2Export, FramesAreThoseOfRep105AndRep103) {
  const json odometry = last("/perdure/odometry");
  EXPECT_EQ(odometry["header"]["frame_id"], "odom");
  EXPECT_EQ(odometry["child_frame_id"], "base_link");
  EXPECT_NEAR(yawOf(odometry["pose"]["pose"]["orientation"]), M_PI / 2, 1e-9);
  EXPECT_NEAR(odometry["twist"]["twist"]["linear"]["x"].get<double>(), 3.0, 1e-9);
  EXPECT_NEAR(odometry["twist"]["twist"]["angular"]["z"].get<double>(), 0.3, 1e-9);
  const json& pose = odometry["pose"]["covariance"];
  EXPECT_NEAR(pose[0].get<double>(), 0.1, 1e-12);
  EXPECT_NEAR(pose[3 * 6 + 3].get<double>(), 0.02, 1e-12);  // the body's y axis is W's x axis
  // Along the body's x axis, which is W's y; a rotation does not change that to first order.
  EXPECT_NEAR(odometry["twist"]["covariance"][0].get<double>(), 2.0, 1e-12);
  EXPECT_NEAR(odometry["twist"]["covariance"][7].get<double>(), 1.0 + 9 * 0.03, 1e-12);
  const json moving = last("/tf")["transforms"];
  EXPECT_EQ(moving[0]["header"]["frame_id"], "map");
  EXPECT_EQ(moving[0]["child_frame_id"], "odom");
  EXPECT_EQ(moving[0]["transform"]["translation"]["x"], 100.0);
  EXPECT_EQ(moving[1]["child_frame_id"], "base_link");
  std::map<std::string, json> fixed;
  const json fixed_ones = last("/tf_static")["transforms"];
  for (const json& one : fixed_ones) fixed[one["child_frame_id"]] = one;
  EXPECT_EQ(fixed.at("imu_link")["header"]["frame_id"], "base_link");
  // The camera looks forwards, so that its link has the body's orientation.
  EXPECT_NEAR(std::abs(fixed.at("cam0_link")["transform"]["rotation"]["w"].get<double>()), 1, 1e-9);
  EXPECT_EQ(fixed.at("cam0_optical")["header"]["frame_id"], "cam0_link");
  EXPECT_NEAR(fixed.at("cam0_optical")["transform"]["rotation"]["x"].get<double>(), -0.5, 1e-9);
}

TEST_F(Ros2Export, ObjectsAreDetectionsAndMarkers) {
  const json detections = last("/perdure/objects")["detections"];
  ASSERT_EQ(detections.size(), 2u);  // only confirmed objects
  EXPECT_EQ(detections[0]["id"], "12");
  EXPECT_NEAR(detections[0]["bbox"]["size"]["x"].get<double>(), 4.0, 1e-9);
  EXPECT_NEAR(yawOf(detections[0]["bbox"]["center"]["orientation"]), M_PI / 2, 1e-9);
  const json& results = detections[0]["results"];
  ASSERT_EQ(results.size(), 2u);
  EXPECT_EQ(results[1]["hypothesis"]["class_id"], "van");
  EXPECT_NEAR(results[1]["hypothesis"]["score"].get<double>(), 0.2, 1e-9);
  EXPECT_EQ(results[1]["pose"]["pose"]["position"]["x"], 5.5);
  EXPECT_NEAR(results[0]["pose"]["covariance"][35].get<double>(), 0.04, 1e-12);
  EXPECT_NEAR(results[0]["pose"]["covariance"][5].get<double>(), 0.01, 1e-12);
  const json markers = last("/perdure/markers")["markers"];
  ASSERT_EQ(markers.size(), 6u);
  EXPECT_EQ(markers[0]["action"], 3);
  EXPECT_EQ(markers[1]["type"], 1);
  EXPECT_EQ(markers[1]["ns"], "car");
  EXPECT_EQ(markers[2]["points"].size(), 26u);
  EXPECT_EQ(markers[3]["text"], "car 12");
  EXPECT_GT(markers[4]["points"].size(), 60u);  // a dashed line
  EXPECT_EQ(markers[5]["text"], "car 13 (hidden)");
}

TEST_F(Ros2Export, WhatTheNetworkSawTheLandmarksAndTheStateOfServices) {
  const json found = last("/perdure/detections")["detections"];
  ASSERT_EQ(found.size(), 1u);  // an answer to a prediction is not exported
  EXPECT_EQ(found[0]["bbox"]["center"]["position"]["y"], 40.0);
  EXPECT_EQ(found[0]["bbox"]["size_x"], 20.0);
  EXPECT_EQ(found[0]["results"][0]["hypothesis"]["class_id"], "car");
  EXPECT_NEAR(found[0]["results"][0]["hypothesis"]["score"].get<double>(), 0.6, 1e-6);
  const json cloud = last("/perdure/landmarks");
  EXPECT_EQ(cloud["width"], 2);
  EXPECT_EQ(cloud["fields"][3]["name"], "intensity");
  const auto bytes = cloud["data"].get<std::vector<std::uint8_t>>();
  std::array<float, 4> point{};
  ASSERT_EQ(bytes.size(), 32u);
  std::memcpy(point.data(), bytes.data() + 16, 16);
  EXPECT_THAT(point, testing::ElementsAre(1.5f, 2.5f, 3.5f, 0.5f));
  const json status = last("/perdure/diagnostics")["status"][0];
  EXPECT_EQ(status["level"], 1);
  EXPECT_EQ(status["name"], "perdure/vio");
  EXPECT_EQ(status["message"], "no inertial samples");
  EXPECT_EQ(status["values"].back(), json({{"key", "imu_gap"}, {"value", "4"}}));
}

}  // namespace
}  // namespace perdure::test
