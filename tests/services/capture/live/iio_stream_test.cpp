// Tests the real libiio with a simulated iiod over loopback.
#include "services/capture/live/iio_stream.h"

#include <gmock/gmock.h>
#include <unistd.h>

#include <chrono>
#include <cmath>

#include "services/capture/live/clocks.h"
#include "tests/services/capture/live/fake_iiod.h"
#include "tests/services/capture/live/times.h"

namespace perdure::capture {
namespace {

using namespace std::chrono_literals;
using testing::FakeIiod;
using testing::FakeImu;
using ::testing::HasSubstr;

/// Returns an address for this process and test, because tests run in parallel.
std::string ownAddress() {
  static int tests = 0;
  const int pid = getpid();
  return "127." + std::to_string(100 + ++tests) + "." + std::to_string(pid / 250 % 250) + "." +
         std::to_string(1 + pid % 250);
}

class Stream : public ::testing::Test {
 protected:
  void open(IioSettings settings = {}) {
    settings.uri = "ip:" + address_ + port_;
    stream_ = std::make_unique<IioStream>(settings, [this](const IioScan& scan) {
      const std::lock_guard lock(mutex_);
      scans_.push_back(scan);
      arrived_ns_.push_back(HostClock::nowNs());
    });
  }
  std::size_t count() {
    const std::lock_guard lock(mutex_);
    return scans_.size();
  }
  bool waitFor(const std::function<bool()>& so, std::chrono::seconds longest = 10s) {
    const auto end = std::chrono::steady_clock::now() + longest;
    while (!so() && std::chrono::steady_clock::now() < end) std::this_thread::sleep_for(5ms);
    return so();
  }
  bool flows(std::size_t scans) {
    return waitFor([&] { return count() >= scans; });
  }

  const std::string address_ = ownAddress();
  std::string port_ = {};
  std::mutex mutex_;
  std::vector<IioScan> scans_;
  std::vector<std::int64_t> arrived_ns_;
  std::unique_ptr<IioStream> stream_;
};

TEST_F(Stream, GivesEveryScanInUnitsAtItsTimeWhateverTheClockThere) {
  const FakeIiod iiod(address_, {{.clock_ns = -977 * kSecond}});
  open({.rate_hz = 200.0});
  ASSERT_TRUE(flows(400)) << stream_->state().problem();
  EXPECT_EQ(stream_->state().problem(), "");
  EXPECT_THAT(stream_->state().name(), HasSubstr("imu at 200 Hz"));
  EXPECT_EQ(iiod.rateAskedFor(), 200.0);
  stream_.reset();
  for (std::size_t i = 1; i < scans_.size(); ++i) {
    const IioScan &before = scans_[i - 1], &now = scans_[i];
    EXPECT_TRUE(now.accel->isApprox(Eigen::Vector3d(0.05, -0.06, 9.81), 1e-9));
    EXPECT_NEAR(now.gyro->y(), -0.007, 1e-12);
    const double step = now.gyro->x() - before.gyro->x();
    EXPECT_NEAR(step < 0 ? step + 1.0 : step, 0.001, 1e-9) << "a scan is missing";
    EXPECT_NEAR(static_cast<double>(now.time_ns - before.time_ns), 5e6, 5e5);
    EXPECT_LE(now.time_ns, arrived_ns_[i] + kSecond / 1000);
    EXPECT_LT(arrived_ns_[i] - now.time_ns, kSecond / 2);
  }
}

TEST_F(Stream, CountsWhereTheDeviceHasNoStamps) {
  const FakeIiod iiod(address_, {{.stamps = false, .rate_hz = 100.0}});
  open({.rate_hz = 100.0});
  ASSERT_TRUE(flows(150)) << stream_->state().problem();
  stream_.reset();
  for (std::size_t i = 1; i < scans_.size(); ++i) {
    EXPECT_NEAR(static_cast<double>(scans_[i].time_ns - scans_[i - 1].time_ns), 1e7, 5e5);
  }
}

TEST_F(Stream, TurnsTheAxesAsMounted) {
  const FakeIiod iiod(address_, {{.mount = "0, -1, 0; 1, 0, 0; 0, 0, 1"}});
  open();
  ASSERT_TRUE(flows(1)) << stream_->state().problem();
  stream_.reset();
  EXPECT_TRUE(scans_[0].accel->isApprox(Eigen::Vector3d(0.06, 0.05, 9.81), 1e-9));
  scans_.clear();
  open({.mount = {1, 0, 0, 0, 0, -1, 0, 1, 0}});
  ASSERT_TRUE(flows(1));
  stream_.reset();
  EXPECT_TRUE(scans_[0].accel->isApprox(Eigen::Vector3d(0.05, -9.81, -0.06), 1e-9))
      << "the configuration's goes before the device's";
}

TEST_F(Stream, TurnsTheAxesByAMatrixThatIsOneForAllChannels) {
  const FakeIiod iiod(address_, {{.mount = "0, -1, 0; 1, 0, 0; 0, 0, 1", .shared_mount = true}});
  open();
  ASSERT_TRUE(flows(1)) << stream_->state().problem();
  stream_.reset();
  EXPECT_TRUE(scans_[0].accel->isApprox(Eigen::Vector3d(0.06, 0.05, 9.81), 1e-9));
  EXPECT_TRUE(scans_[0].gyro->isApprox(Eigen::Vector3d(0.007, scans_[0].gyro->y(), 0.003), 1e-9));
}

TEST_F(Stream, SetsTheRateOfTheTriggerAndSaysWhatThatMadeOfIt) {
  const FakeIiod iiod(address_, {{.needs_trigger = true}});
  open({.rate_hz = 250.0, .trigger = "hrtimer"});
  ASSERT_TRUE(flows(100)) << stream_->state().problem();
  EXPECT_THAT(stream_->state().name(), HasSubstr("imu at 250 Hz"));
  stream_.reset();
  EXPECT_EQ(iiod.triggerRate(), 250.0);
  EXPECT_NEAR(static_cast<double>(scans_[80].time_ns - scans_[79].time_ns), 4e6, 5e5);
  open({.rate_hz = 1000.0, .trigger = "hrtimer"});
  ASSERT_TRUE(waitFor([&] { return stream_->state().name() == "imu at 500 Hz"; }))
      << stream_->state().name();
}

TEST_F(Stream, TakesTheDeviceAndTheTriggerThatAreNamed) {
  const FakeIiod iiod(
      address_, {{.id = "iio:device0", .name = "pressure", .gyro = false, .accel = false},
                 {.id = "iio:device1", .name = "bmi_gyro", .accel = false},
                 {.id = "iio:device2", .name = "bmi_accel", .gyro = false, .needs_trigger = true}});
  open({.device = "bmi_accel", .trigger = "hrtimer", .gyro = false});
  ASSERT_TRUE(flows(1)) << stream_->state().problem();
  stream_.reset();
  EXPECT_EQ(iiod.triggerSet(), "trigger0");
  EXPECT_FALSE(scans_[0].gyro);
  EXPECT_TRUE(scans_[0].accel);
  scans_.clear();
  open({.accel = false});
  ASSERT_TRUE(flows(1)) << stream_->state().problem();
  EXPECT_THAT(stream_->state().name(), HasSubstr("bmi_gyro"));
}

TEST_F(Stream, SaysWhatIsMissingAndTheFix) {
  open();
  ASSERT_TRUE(waitFor([&] { return stream_->state().reasons().of("imu_absent") > 0; }));
  EXPECT_THAT(stream_->state().problem(), HasSubstr("no IIO context at ip:" + address_));
  EXPECT_THAT(stream_->state().problem(), HasSubstr("imu.uri"));
  stream_.reset();
  const FakeIiod iiod(address_, {{.gyro = false, .needs_trigger = true}});
  open();
  ASSERT_TRUE(waitFor([&] { return stream_->state().reasons().of("imu_absent") > 0; }));
  EXPECT_THAT(stream_->state().problem(), HasSubstr("an accelerometer and a gyroscope"));
  EXPECT_THAT(stream_->state().problem(), HasSubstr("imu, hrtimer"));
  open({.gyro = false});
  ASSERT_TRUE(waitFor([&] { return stream_->state().reasons().of("imu_absent") > 0; }));
  EXPECT_THAT(stream_->state().problem(), HasSubstr("imu.trigger"));
  open({.trigger = "nobody", .gyro = false});
  ASSERT_TRUE(waitFor([&] { return stream_->state().reasons().of("imu_absent") > 0; }));
  EXPECT_THAT(stream_->state().problem(), HasSubstr("the trigger nobody"));
  EXPECT_EQ(count(), 0U);
}

TEST_F(Stream, GoesOnWhenTheImuComesBack) {
  auto iiod = std::make_unique<FakeIiod>(address_, std::vector<FakeImu>{{}});
  open();
  ASSERT_TRUE(flows(50)) << stream_->state().problem();
  iiod.reset();
  ASSERT_TRUE(waitFor([&] { return stream_->state().reasons().of("imu_lost") == 1; }));
  EXPECT_NE(stream_->state().problem(), "");
  EXPECT_EQ(stream_->state().name(), "");
  iiod = std::make_unique<FakeIiod>(address_, std::vector<FakeImu>{{}});
  const std::size_t before = count();
  ASSERT_TRUE(flows(before + 50)) << stream_->state().problem();
  EXPECT_EQ(stream_->state().problem(), "");
  iiod->fallSilent();
  ASSERT_TRUE(waitFor([&] { return stream_->state().reasons().of("imu_lost") == 2; }))
      << "nothing came, and the connection stood";
}

// libiio writes into a URI that has a port, so that a later attempt must get a complete URI.
TEST_F(Stream, BehindAPortTheImuIsFoundWhenItComes) {
  port_ = ":30431";
  open();
  ASSERT_TRUE(waitFor([&] { return stream_->state().reasons().of("imu_absent") >= 2; }));
  EXPECT_THAT(stream_->state().problem(), HasSubstr(address_ + port_));
  const FakeIiod iiod(address_, {{}});
  EXPECT_TRUE(flows(50)) << stream_->state().problem();
}

TEST_F(Stream, FollowsAClockThatIsSetThereAndCountsIt) {
  FakeIiod iiod(address_, {{}});
  open();
  ASSERT_TRUE(flows(150));
  iiod.stepClock(5 * kSecond);
  ASSERT_TRUE(waitFor([&] { return stream_->state().reasons().of("imu_clock_jump") == 1; }));
  const std::size_t before = count();
  ASSERT_TRUE(flows(before + 20));
  stream_.reset();
  EXPECT_LT(std::abs(scans_.back().time_ns - arrived_ns_.back()), kSecond / 2);
}

}  // namespace
}  // namespace perdure::capture
