// Tests live capture on the bus with two simulated cameras, one of which is unplugged.
#include <gmock/gmock.h>
#include <spdlog/sinks/null_sink.h>

#include <fstream>
#include <future>
#include <map>
#include <set>
#include <thread>

#include "common/base/errors.h"
#include "common/replay/files/rig_file.h"
#include "services/capture/live.h"
#include "tests/process/support.h"
#include "tests/services/capture/live/cameras/fake_camera.h"
#include "tests/services/capture/live/times.h"
#include "tests/services/run_until.h"

namespace perdure::capture {
namespace {

using namespace std::chrono_literals;
using test::runUntil;
using testing::FakeCamera;
using ::testing::HasSubstr;

class StereoLive : public ::testing::Test {
 protected:
  StereoLive() {
    loop_.on(calibrations_, [this](const Calibration& c) { calibration_ = c; });
    loop_.on(health_, [this](const Health& h) { last_health_ = h; });
    loop_.on(left_images_,
             [this](const Frame& f) { left_times_[f.stamp.sequence] = f.stamp.time; });
    loop_.on(right_images_,
             [this](const Frame& f) { right_times_[f.stamp.sequence] = f.stamp.time; });
  }
  Config config(std::size_t cameras_of_rig = 2) {
    Calibration rig;
    for (std::size_t i = 0; i < cameras_of_rig; ++i) {
      CameraCalibration camera;
      camera.name = cameraName(i);
      camera.width = camera.height = 8;
      camera.fx = camera.fy = 10.0;
      camera.cx = camera.cy = 4.0;
      camera.rate_hz = 20.0;
      camera.T_BC.p.y() = -0.1 * static_cast<double>(i);
      rig.cameras.push_back(camera);
    }
    Config config;
    config.source = "libcamera";
    config.rig = folder_.file("rig.yaml");
    std::ofstream(config.rig) << replay::rigText(rig, "of a test");
    config.camera.id = "left";
    config.camera.second = "right";
    config.camera.exposure_ms = 5.0;
    return config;
  }
  std::vector<OpenCamera> openers(const std::vector<CameraSettings>& settings) {
    settings_ = settings;
    std::vector<OpenCamera> all = {left_.opener(), right_.opener()};
    all.resize(settings.size());
    return all;
  }
  /// Runs the service until `look` returns.
  void serve(const Config& config, const std::function<void()>& look) {
    const auto log =
        std::make_shared<spdlog::logger>("test", std::make_shared<spdlog::sinks::null_sink_mt>());
    service::Context context("capture", domain_, log);
    Live live(context, config,
              [this](const auto& settings, const auto&) { return openers(settings); });
    std::thread service([&] { context.run(); });
    look();
    context.stop();
    service.join();
  }
  /// Takes an image with both cameras twenty times per second. The image of cam1 comes first and
  /// waits for cam0.
  void shoot() {
    const auto now = std::chrono::steady_clock::now();
    if (now < next_) return;
    next_ = now + 50ms;
    const std::int64_t t = HostClock::nowNs();
    right_.shoot(moment_, t + kMs);
    left_.shoot(moment_++, t);
  }
  bool shootUntil(const std::function<bool()>& done) {
    return runUntil(loop_, [&] {
      shoot();
      return done();
    });
  }
  std::size_t pairs() const {
    std::size_t n = 0;
    for (const auto& [number, time] : right_times_) n += left_times_.count(number);
    return n;
  }

  test::Folder folder_;
  const FakeCamera left_{"left"}, right_{"right"};
  std::vector<CameraSettings> settings_;
  std::uint32_t moment_ = 0;
  std::chrono::steady_clock::time_point next_;
  bus::Domain domain_{test::ownNetwork()};
  bus::Participant participant_{domain_, "vio"};
  bus::Reader<Calibration> calibrations_{participant_, bus::kTopic<Calibration>};
  bus::Reader<Frame> left_images_{participant_, bus::frameTopic("cam0")};
  bus::Reader<Frame> right_images_{participant_, bus::frameTopic("cam1")};
  bus::Reader<Health> health_{participant_, bus::kTopic<Health>};
  bus::WaitLoop loop_{participant_};
  Calibration calibration_;
  Health last_health_;
  std::map<std::uint64_t, TimePoint> left_times_, right_times_;
};

TEST_F(StereoLive, GivesPairsAndGoesOnWithOneCameraWhileTheOtherIsUnplugged) {
  serve(config(), [&] {
    ASSERT_TRUE(shootUntil([&] { return pairs() >= 10; }));
    EXPECT_EQ(calibration_.cameras.size(), 2u);
    for (const auto& [number, time] : right_times_) {
      if (!left_times_.contains(number)) continue;
      EXPECT_EQ(time - left_times_[number], std::chrono::milliseconds(1));
    }

    right_.unplug();
    ASSERT_TRUE(shootUntil([&] { return last_health_.reasons["camera_absent_cam1"] > 0; }));
    EXPECT_EQ(last_health_.state, HealthState::kDegraded);
    EXPECT_THAT(last_health_.message, HasSubstr("cam1: right is not plugged in"));
    EXPECT_EQ(last_health_.reasons["camera_lost_cam1"], 1u);
    EXPECT_EQ(last_health_.reasons["camera_absent_cam0"], 0u);
    const std::size_t alone = left_times_.size();
    ASSERT_TRUE(shootUntil([&] { return left_times_.size() >= alone + 10; })) << "cam0 goes on";

    right_.plug();
    const std::size_t before = pairs();
    ASSERT_TRUE(shootUntil([&] { return pairs() >= before + 10; }));
    ASSERT_TRUE(shootUntil([&] { return last_health_.state == HealthState::kOk; }))
        << last_health_.message;
    EXPECT_GE(last_health_.reasons["stereo_unpaired_cam0"], 10u);
  });
}

TEST_F(StereoLive, AsksBothForTheSameAndEachForItsOwnEncoding) {
  serve(config(), [&] {
    ASSERT_EQ(settings_.size(), 2u);
    EXPECT_EQ(settings_[0].id, "left");
    EXPECT_EQ(settings_[1].id, "right");
    EXPECT_EQ(settings_[0].encoding, "as_is");
    EXPECT_EQ(settings_[1].encoding, "mono8");
    for (const auto& settings : settings_) {
      EXPECT_TRUE(settings.id_alone);
      EXPECT_EQ(settings.width, 8u);
      EXPECT_EQ(settings.exposure_ms, 5.0);
    }
  });
}

TEST_F(StereoLive, ARigWithoutCam1IsRefusedWhereThereIsASecondCamera) {
  try {
    serve(config(1), [] { ADD_FAILURE() << "it began"; });
    FAIL() << "it is taken";
  } catch (const StartupError& error) {
    EXPECT_THAT(error.what(), HasSubstr("has no cam1"));
    EXPECT_THAT(error.what(), HasSubstr("leave camera.second empty"));
  }
}

TEST_F(StereoLive, ARigWithCam1AndOneCameraIsToldAndUsedWithoutIt) {
  Config one = config();
  one.camera.second.clear();
  serve(one, [&] {
    ASSERT_TRUE(shootUntil([&] { return left_times_.size() >= 5; }));
    EXPECT_EQ(calibration_.cameras.size(), 1u);
    ASSERT_TRUE(shootUntil([&] { return last_health_.state == HealthState::kOk; }));
    EXPECT_THAT(last_health_.message, HasSubstr("camera.second names no camera for it"));
    EXPECT_TRUE(right_times_.empty());
  });
}

TEST_F(StereoLive, TwoCamerasNeedTwoIds) {
  Config same = config();
  same.camera.second = same.camera.id;
  EXPECT_THROW(requireSource(same), StartupError);
  Config first = config();
  first.camera.id.clear();
  try {
    requireSource(first);
    FAIL() << "it is taken";
  } catch (const StartupError& error) {
    EXPECT_THAT(error.what(), HasSubstr("perdure-capture --list"));
  }
}

}  // namespace
}  // namespace perdure::capture
