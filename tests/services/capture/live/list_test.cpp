// Tests the output of --list: for simulated sensors, for an iiod, and without sensors.
#include "services/capture/list.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include "tests/services/capture/live/fake_iiod.h"

namespace perdure::capture {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

Seen cameraAndImu() {
  SeenCamera camera;
  camera.id = "\\_SB_.PCI0: it's-1.0-046d:0825";
  camera.model = "UVC Camera";
  camera.modes = {{"YUYV", {{640, 480}, {1280, 720}, {1920, 1080}}}, {"MJPEG", {{1920, 1080}}}};
  camera.slowest_hz = 5, camera.fastest_hz = 30;
  camera.settable = {"camera.rate_hz", "camera.exposure_ms"};
  SeenImu imu{"iio:device0", "bmi160", true, true, "25 50 100 200", 200.0, {"hrtimer0"}};
  return {{camera}, {imu}, {}};
}

YAML::Node pasted(const std::string& text) {
  return YAML::Load(text.substr(text.find("# to paste into capture.yaml")));
}

TEST(ListOfSensors, NamesModesAndRatesAndAConfigurationThatCanBeRead) {
  const std::string text = describe(cameraAndImu(), "local:");
  EXPECT_THAT(text, AllOf(HasSubstr("UVC Camera"), HasSubstr("YUYV    640x480 1280x720 1920x1080"),
                          HasSubstr("5 to 30 Hz"), HasSubstr("camera.exposure_ms"),
                          HasSubstr("25 50 100 200 Hz"), HasSubstr("hrtimer0")));
  const YAML::Node yaml = pasted(text);
  EXPECT_EQ(yaml["source"].as<std::string>(), "libcamera");
  EXPECT_EQ(yaml["camera"]["id"].as<std::string>(), "\\_SB_.PCI0: it's-1.0-046d:0825");
  EXPECT_EQ(yaml["camera"]["rate_hz"].as<double>(), 20.0);
  EXPECT_EQ(yaml["imu"]["gyro"].as<std::string>(), "bmi160");
  EXPECT_EQ(yaml["imu"]["rate_hz"].as<double>(), 200.0);
  EXPECT_EQ(yaml["imu"]["trigger"].as<std::string>(), "hrtimer0");
  EXPECT_THAT(text, HasSubstr("of images of 1280x720"));
}

TEST(ListOfSensors, TwoCamerasAreBothPastedWithWhatBothHave) {
  Seen seen = cameraAndImu();
  EXPECT_THAT(describe(seen, "local:"), Not(HasSubstr("second:")));
  SeenCamera other = seen.cameras.front();
  other.id = "imx219 10-0010";
  other.modes = {{"YUYV", {{640, 480}}}};
  other.fastest_hz = 15;
  seen.cameras.push_back(other);
  const std::string text = describe(seen, "local:");
  const YAML::Node camera = pasted(text)["camera"];
  EXPECT_EQ(camera["id"].as<std::string>(), "\\_SB_.PCI0: it's-1.0-046d:0825");
  EXPECT_EQ(camera["second"].as<std::string>(), "imx219 10-0010");
  EXPECT_EQ(camera["rate_hz"].as<double>(), 15.0);
  EXPECT_THAT(text, HasSubstr("of images of 640x480"));
}

TEST(ListOfSensors, TwoDevicesOfAnImuAreBothNamed) {
  Seen seen = cameraAndImu();
  seen.cameras.clear();
  seen.imus[0].accel = false;
  seen.imus.push_back({"iio:device1", "adxl345", false, true, "", 0.0, {}});
  const std::string text = describe(seen, "ip:robot");
  const YAML::Node yaml = pasted(text);
  EXPECT_EQ(yaml["imu"]["gyro"].as<std::string>(), "bmi160");
  EXPECT_EQ(yaml["imu"]["accel"].as<std::string>(), "adxl345");
  EXPECT_EQ(yaml["imu"]["uri"].as<std::string>(), "ip:robot");
  EXPECT_THAT(text, HasSubstr("no camera: libcamera was asked"));
}

TEST(ListOfSensors, WithoutAnyItSaysWhatWasLookedFor) {
  const std::string text =
      describe({{}, {}, {"libcamera does not start: No such device"}}, "local:");
  EXPECT_THAT(text, AllOf(HasSubstr("no camera: libcamera was asked"), HasSubstr("no IMU: local:"),
                          HasSubstr("note: libcamera does not start"), Not(HasSubstr("to paste"))));
}

TEST(ListOfSensors, AnIiodsDeviceIsNamed) {
  const testing::FakeIiod iiod("127.0.7.41", {{.rate_hz = 100.0}});
  const Seen seen = lookAround("ip:127.0.7.41");
  ASSERT_EQ(seen.imus.size(), 1u);
  EXPECT_TRUE(seen.imus[0].gyro);
  EXPECT_TRUE(seen.imus[0].accel);
  const YAML::Node yaml = pasted(describe(seen, "ip:127.0.7.41"));
  EXPECT_EQ(yaml["imu"]["uri"].as<std::string>(), "ip:127.0.7.41");
}

TEST(ListOfSensors, AHostThatDoesNotAnswerIsAProblemWithTheFix) {
  const Seen seen = lookAround("ip:127.0.0.1:1");
  EXPECT_TRUE(seen.imus.empty());
  ASSERT_FALSE(seen.problems.empty());
  EXPECT_THAT(seen.problems.back(), HasSubstr("ip:127.0.0.1:1 does not answer"));
}

}  // namespace
}  // namespace perdure::capture
