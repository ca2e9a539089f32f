// Tests perdure-capture with live sensors: an IMU behind an iiod, and no camera.
#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cmath>
#include <fstream>
#include <memory>
#include <string_view>

#include "common/replay/files/rig_file.h"
#include "tests/process/support.h"
#include "tests/services/capture/live/fake_iiod.h"
#include "tests/services/run_until.h"

namespace perdure::capture {
namespace {

using namespace std::chrono_literals;
using test::Child;
using test::runUntil;
using testing::FakeIiod;
using testing::FakeImu;
using ::testing::HasSubstr;

class LiveProcess : public ::testing::Test {
 protected:
  LiveProcess() {
    loop_.on(calibrations_, [this](const Calibration& c) { calibration_ = c; });
    loop_.on(imu_, [this](const ImuSample& s) {
      if (!samples_.empty() && s.source == samples_.back().source) {
        EXPECT_EQ(s.sequence, samples_.back().sequence + 1);
        EXPECT_GT(s.time, samples_.back().time);
      }
      samples_.push_back(s);
    });
    loop_.on(health_, [this](const Health& h) { last_health_ = h; });
  }
  static Calibration rig(bool with_camera = true) {
    Calibration rig;
    CameraCalibration camera;
    camera.name = with_camera ? "cam0" : "cam1";
    camera.width = 640;
    camera.height = 480;
    camera.fx = camera.fy = 500.0;
    camera.cx = 320.0;
    camera.cy = 240.0;
    camera.rate_hz = 20.0;
    rig.cameras = {camera};
    rig.imu = ImuCalibration{1e-3, 1e-5, 1e-2, 1e-4, 200.0};
    return rig;
  }
  std::vector<std::string> command(std::vector<std::string> more, const Calibration& of = rig()) {
    const std::string file = folder_.file("rig.yaml");
    std::ofstream(file) << replay::rigText(of, "of a test");
    std::vector<std::string> words = {(test::programs() / "perdure-capture").string(), "--set",
                                      "source=libcamera"};
    more.push_back("rig=" + file);
    for (auto& assignment : more) words.insert(words.end(), {"--set", std::move(assignment)});
    return words;
  }

  const std::string address_ =
      "127.99." + std::to_string(getpid() / 250 % 250) + "." + std::to_string(1 + getpid() % 250);
  test::Folder folder_;
  bus::Domain domain_{test::ownNetwork()};
  bus::Participant participant_{domain_, "vio"};
  bus::Reader<ImuSample> imu_{participant_, bus::kTopic<ImuSample>};
  bus::Reader<Calibration> calibrations_{participant_, bus::kTopic<Calibration>};
  bus::Reader<Health> health_{participant_, bus::kTopic<Health>};
  bus::WaitLoop loop_{participant_};
  Calibration calibration_;
  std::vector<ImuSample> samples_;
  Health last_health_;
};

/// Uses two devices with different sample times; the camera is missing throughout.
TEST_F(LiveProcess, GivesWhatThereIsSaysWhatIsMissingAndGoesOnWhenItComesBack) {
  const std::vector<FakeImu> imus = {
      {.id = "iio:device0", .name = "gyro", .accel = false, .rate_hz = 200.0},
      {.id = "iio:device1", .name = "accel", .gyro = false, .rate_hz = 125.0}};
  auto iiod = std::make_unique<FakeIiod>(address_, imus);
  const Child capture(command({"imu.uri=ip:" + address_, "imu.gyro=gyro", "imu.accel=accel",
                               "camera.id=that nobody has"}),
                      folder_.file("log"));
  ASSERT_TRUE(runUntil(loop_, [&] { return samples_.size() >= 200; })) << capture.log();
  EXPECT_TRUE(samples_.back().accel.isApprox(Eigen::Vector3d(0.05, -0.06, 9.81), 1e-9));
  EXPECT_NEAR(samples_.back().gyro.z(), 0.003, 1e-12);
  const double age =
      1e-9 * static_cast<double>(std::chrono::system_clock::now().time_since_epoch().count() -
                                 toNanoseconds(samples_.back().time));
  EXPECT_LT(std::abs(age), 1.0) << "stamps are on the wall clock";
  EXPECT_EQ(calibration_.cameras.size(), 1U);
  EXPECT_TRUE(calibration_.imu);
  ASSERT_TRUE(runUntil(loop_, [&] { return last_health_.state == HealthState::kDegraded; }));
  EXPECT_THAT(last_health_.message,
              HasSubstr("libcamera sees no camera with that nobody has in its id"));
  EXPECT_GT(last_health_.reasons["camera_absent"], 0U);
  EXPECT_EQ(last_health_.reasons["imu_absent"], 0U);

  iiod.reset();
  ASSERT_TRUE(runUntil(loop_, [&] { return last_health_.reasons["imu_lost"] == 2; }))
      << last_health_.message;
  EXPECT_THAT(last_health_.message, HasSubstr("IMU"));
  const std::size_t before = samples_.size();
  iiod = std::make_unique<FakeIiod>(address_, imus);
  ASSERT_TRUE(runUntil(loop_, [&] { return samples_.size() >= before + 100; })) << capture.log();
  ASSERT_TRUE(runUntil(loop_, [&] {
    return last_health_.message.find("IMU") == std::string::npos;
  })) << last_health_.message;
}

/// Uses libcamera itself, with one manager for both cameras.
TEST_F(LiveProcess, NamesBothCamerasThatAreMissing) {
  Calibration both = rig();
  both.cameras.push_back(both.cameras.front());
  both.cameras.back().name = "cam1";
  both.imu.reset();
  const Child capture(command({"camera.id=nobodys left", "camera.second=nobodys right"}, both),
                      folder_.file("log"));
  ASSERT_TRUE(runUntil(loop_,
                       [&] {
                         return last_health_.reasons["camera_absent_cam0"] > 3 &&
                                last_health_.reasons["camera_absent_cam1"] > 3;
                       }))
      << last_health_.message << capture.log();
  EXPECT_EQ(last_health_.state, HealthState::kDegraded);
  EXPECT_THAT(last_health_.message, HasSubstr("cam0: libcamera sees no camera with nobodys left"));
  EXPECT_THAT(last_health_.message, HasSubstr("cam1: libcamera sees no camera with nobodys right"));
  EXPECT_EQ(calibration_.cameras.size(), 2U);
}

TEST_F(LiveProcess, SaysThatAnImuWithAFrozenClockGivesNoSamples) {
  const FakeIiod iiod(address_, {{.rate_hz = 400.0, .frozen_clock = true}});
  const Child capture(command({"imu.uri=ip:" + address_, "imu.rate_hz=400"}), folder_.file("log"));
  ASSERT_TRUE(runUntil(loop_, [&] {
    return last_health_.message.find("became samples") != std::string::npos;
  })) << last_health_.message;
  EXPECT_EQ(last_health_.state, HealthState::kDegraded);
  EXPECT_THAT(last_health_.message, HasSubstr("current_timestamp_clock"));
  EXPECT_GT(last_health_.reasons["imu_out_of_order"], 0U);
}

/// Sends datagrams to the addresses on which capture listens.
class Vehicle {
 public:
  explicit Vehicle(const std::string& host) { (void)inet_aton(host.c_str(), &host_); }
  ~Vehicle() { ::close(socket_); }
  void send(int port, const std::string& text) const {
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_addr = host_;
    to.sin_port = htons(static_cast<std::uint16_t>(port));
    (void)::sendto(socket_, text.data(), text.size(), 0, reinterpret_cast<const sockaddr*>(&to),
                   sizeof to);
  }

 private:
  in_addr host_{};
  int socket_ = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
};

/// Plays gpsd for one client: a drive to the east at 10 m/s.
class Gpsd {
 public:
  explicit Gpsd(const std::string& host) {
    sockaddr_in at{};
    at.sin_family = AF_INET;
    (void)inet_aton(host.c_str(), &at.sin_addr);
    at.sin_port = htons(2947);
    (void)::bind(socket_, reinterpret_cast<const sockaddr*>(&at), sizeof at);
    (void)::listen(socket_, 1);
  }
  ~Gpsd() {
    ::close(client_);
    ::close(socket_);
  }
  void report() {
    constexpr std::string_view kFix =
        R"({"class":"TPV","mode":3,"lat":49.0,"lon":8.4,"altHAE":110,"eph":4,"speed":10,"track":90})"
        "\n";
    if (client_ < 0) client_ = ::accept4(socket_, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
    if (client_ >= 0) (void)::send(client_, kFix.data(), kFix.size(), MSG_NOSIGNAL);
  }

 private:
  int socket_ = ::socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0), client_ = -1;
};

TEST_F(LiveProcess, GivesTheSpeedAndTheVehiclesPlaceOnEarth) {
  const Vehicle vehicle(address_);
  Gpsd gpsd(address_);
  std::vector<SpeedSample> speeds;
  bus::Reader<SpeedSample> speed(participant_, bus::kTopic<SpeedSample>);
  loop_.on(speed, [&](const SpeedSample& s) { speeds.push_back(s); });
  const Child capture(
      command({"imu.uri=ip:" + address_, "speed.source=udp", "speed.address=" + address_ + ":5600",
               "gnss.source=gpsd", "gnss.address=" + address_ + ":2947"}),
      folder_.file("log"));
  ASSERT_TRUE(runUntil(
      loop_, [&] { return last_health_.message.find("says nothing") != std::string::npos; }))
      << last_health_.message << capture.log();
  EXPECT_TRUE(calibration_.has_speed);
  EXPECT_FALSE(calibration_.anchor);
  int calls = 0;
  ASSERT_TRUE(runUntil(loop_,
                       [&] {
                         vehicle.send(5600, "10.0 0.05");
                         if (++calls % 4 == 0) gpsd.report();
                         return calibration_.anchor.has_value() && speeds.size() >= 20;
                       }))
      << last_health_.message << capture.log();
  EXPECT_DOUBLE_EQ(speeds.back().speed, 10.0);
  EXPECT_DOUBLE_EQ(speeds.back().sigma, 0.05);
  EXPECT_GT(speeds.back().time, speeds.front().time);
  EXPECT_NEAR(calibration_.anchor->latitude_deg, 49.0, 1e-12);
  EXPECT_NEAR(calibration_.anchor->longitude_deg, 8.4, 1e-12);
  EXPECT_NEAR(calibration_.anchor->height_m, 110.0, 1e-5);
  EXPECT_NEAR(calibration_.anchor->yaw, 0.0, 1e-12) << "to the east";
  EXPECT_NEAR(toSeconds(calibration_.anchor->time - speeds.back().time), 0.0, 5.0);
}

TEST_F(LiveProcess, EndsAtOnceWhereTheConfigurationIsWrong) {
  const auto messageOf = [&](const std::vector<std::string>& words, int status) {
    Child capture(words, folder_.file("log"));
    EXPECT_EQ(capture.wait(10s), status) << capture.log();
    return capture.log();
  };
  EXPECT_THAT(messageOf(command({}, rig(false)), 65), HasSubstr("cam0 is missing"));
  EXPECT_THAT(messageOf(command({"imu.mount=[1, 0, 0]"}), 78),
              HasSubstr("imu.mount has 3 numbers"));
  EXPECT_THAT(messageOf(command({"imu.mount=[1, 0, 0, 0, 1, 0, 0, 0, -1]"}), 78),
              HasSubstr("imu.mount is no rotation"));
  EXPECT_THAT(messageOf(command({"camera.crop=[1.5, 0, 20, 20]"}), 78),
              HasSubstr("camera.crop is not"));
  EXPECT_THAT(messageOf(command({"camera.second=right"}), 78), HasSubstr("camera.id is empty"));
  EXPECT_THAT(messageOf(command({"camera.id=left", "camera.second=right"}), 78),
              HasSubstr("has no cam1"));
  EXPECT_THAT(messageOf(command({"speed.source=can"}), 78), HasSubstr("speed.can.signals"));
  EXPECT_THAT(messageOf(command({"speed.source=gnss"}), 78), HasSubstr("set gnss.source"));
  auto without = command({});
  without.resize(without.size() - 2);
  EXPECT_THAT(messageOf(without, 78), HasSubstr("perdure calibrate"));
}

TEST_F(LiveProcess, EndsInTimeWhenItIsTold) {
  const FakeIiod iiod(address_, {{}});
  Child capture(command({"imu.uri=ip:" + address_}), folder_.file("log"));
  ASSERT_TRUE(runUntil(loop_, [&] { return samples_.size() >= 10; })) << capture.log();
  capture.signal(SIGTERM);
  EXPECT_EQ(capture.wait(3s), 0) << capture.log();
}

}  // namespace
}  // namespace perdure::capture
