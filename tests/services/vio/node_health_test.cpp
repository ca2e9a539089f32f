// Tests the node's status: the inputs that it waits for, and the faults of its inputs.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/vio/node.h"
#include "tests/services/vio/player.h"

namespace perdure::vio {
namespace {

using ::testing::HasSubstr;
using namespace test;

TEST(VioNodeHealth, SaysThatTheCamerasClockIsNotThatOfTheImu) {
  using std::chrono::hours;
  Player player(5.0);
  for (const int shift : {-1, 1}) {
    Config config;
    config.max_pending = 10;
    Recorder r;
    Node node(config, 5, r.outputs());
    node.onCalibration(calibration());
    player.play(node, 0.0, 2.0);
    ASSERT_EQ(node.health(), HealthState::kOk);
    player.play(node, 2.05, 4.0, {}, [&](Frame& f, double) {
      f.stamp.time += hours(shift);
      return true;
    });
    EXPECT_EQ(node.health(), HealthState::kDegraded);
    EXPECT_THAT(node.status(), HasSubstr(shift < 0 ? "jumped back" : "no inertial samples"));
    player.play(node, 4.05, 5.0);
    EXPECT_EQ(node.health(), HealthState::kOk) << "well again";
    EXPECT_EQ(node.status(), "");
  }
}

TEST(VioNodeHealth, ARigWhoseSecondCameraDoesNotComeGoesOnWithOneAndSaysSo) {
  Calibration two = calibration();
  two.cameras.push_back(testCamera(1));
  Player player(4.0);
  std::size_t most_waiting = 0, handed = 0;
  const auto playTo = [&](Node& node, const Recorder& r) {
    player.play(
        node, 0.0, 4.0,
        [&](ImuSample&, double t) {
          // One IMU period before the next frame, all unanswered frames wait for cam1.
          if (t > 2.0 && std::abs(std::remainder(t - 0.045, 0.05)) < 1e-6) {
            most_waiting = std::max(most_waiting, handed - r.odometry.size());
          }
          return true;
        },
        [&](Frame&, double) { return ++handed > 0; });
  };
  Recorder r;
  Node node(Config{}, 5, r.outputs());
  node.onCalibration(two);
  playTo(node, r);
  EXPECT_EQ(most_waiting, 0u);
  EXPECT_GT(node.reasons().of("stereo_unpaired"), 60u);
  EXPECT_EQ(r.odometry.back().state, OdometryState::kTracking);
  EXPECT_EQ(node.health(), HealthState::kDegraded);
  EXPECT_THAT(node.status(), HasSubstr("one camera"));
  EXPECT_THAT(node.status(), HasSubstr("stereo.enabled"));
  Config first_only;
  first_only.cameras = {"cam0"};
  Recorder quiet;
  Node mono(first_only, 5, quiet.outputs());
  mono.onCalibration(two);
  player.play(mono, 0.0, 2.0);
  EXPECT_EQ(mono.health(), HealthState::kOk) << "nobody asked for two";
  EXPECT_EQ(mono.reasons().of("stereo_unpaired"), 0u);
}

TEST(VioNodeHealth, IsDegradedOnlyWhileThePositionGrowsUncertain) {
  PositionDoubt doubt(2.0);
  const auto grown = [&](double t, double sigma, double x = 0.0) {
    Matrix9d P = Matrix9d::Zero();
    P(2, 2) = 0.05 * 0.05;
    P(3, 3) = sigma * sigma;
    return doubt.add(fromNanoseconds(0) + durationFromSeconds(t), {x, 0.0, 0.0}, P);
  };
  for (int t = 0; t < 100; ++t) EXPECT_FALSE(grown(t, 30.0 + 0.01 * t)) << "a long, healthy drive";
  EXPECT_TRUE(grown(100, 33.1));
  EXPECT_TRUE(doubt.uncertain());
  EXPECT_FALSE(grown(115, 33.1)) << "it grows no further";
  EXPECT_FALSE(grown(125, 39.1, 200.0)) << "by the heading";
}

TEST(VioNodeHealth, SaysThatAPositionIsUncertain) {
  Player player(5.0);
  Config config;
  config.position_growth_m = 1e-4;
  Recorder r;
  Node node(config, 5, r.outputs());
  node.onCalibration(calibration());
  player.play(node, 0.0, 4.0);
  EXPECT_EQ(r.odometry.back().state, OdometryState::kDegraded);
  EXPECT_EQ(node.health(), HealthState::kDegraded);
  EXPECT_THAT(node.status(), HasSubstr("odometry.position_growth"));
  EXPECT_GT(node.reasons().of("position_uncertain"), 10u);
}

TEST(VioNodeHealth, SaysThatItsConfigurationNamesACameraThatIsNotThere) {
  Player player(2.0);
  const auto statusWith = [&](const std::vector<std::string>& cameras) {
    Config config;
    config.cameras = cameras;
    Recorder r;
    Node node(config, 5, r.outputs());
    node.onCalibration(calibration());
    player.play(node, 0.0, 2.0);
    EXPECT_EQ(node.health(), node.status().empty() ? HealthState::kOk : HealthState::kDegraded);
    return node.status();
  };
  EXPECT_EQ(statusWith({"cam0", "cam1"}), "") << "the default";
  EXPECT_EQ(statusWith({"cam0"}), "");
  EXPECT_THAT(statusWith({"left"}), HasSubstr("names left, which the calibration does not (cam0)"));
  EXPECT_THAT(statusWith({"cam0", "cam9"}), HasSubstr("cam9"));
}

TEST(VioNodeHealth, SaysThatTheSpeedIsRefused) {
  Calibration with_speed = calibration();
  with_speed.has_speed = true;
  Player player(7.0);
  Recorder r;
  Node node(Config{}, 5, r.outputs());
  node.onCalibration(with_speed);
  double unit = 1.0;
  const auto tell = [&](ImuSample& sample, double t) {
    if (std::abs(std::remainder(t, 0.05)) > 1e-6) return true;
    const Nav truth = player.drive().truth(t);
    const double speed = (truth.q_WB.conjugate() * truth.v_WB).x();
    node.onSpeed({1, 0, sample.time, unit * speed, 0.05});
    return true;
  };
  player.play(node, 0.0, 3.0, tell);
  ASSERT_EQ(node.health(), HealthState::kOk) << node.status();
  unit = 3.6;  // km/h
  player.play(node, 3.05, 3.25, tell);
  EXPECT_EQ(node.status(), "") << "a few are nothing to speak of";
  player.play(node, 3.3, 5.0, tell);
  EXPECT_EQ(node.health(), HealthState::kDegraded);
  EXPECT_THAT(node.status(), HasSubstr("speed contradicts camera and IMU"));
  EXPECT_THAT(node.status(), HasSubstr("m/s"));
  unit = 1.0;
  player.play(node, 5.05, 7.0, tell);
  EXPECT_EQ(node.status(), "") << "well again";
}

TEST(VioNodeHealth, SaysThatFramesHaveAnotherSizeThanTheirCalibration) {
  Recorder r;
  Node node(Config{}, 5, r.outputs());
  node.onCalibration(calibration());
  Player player(4.0);
  player.play(node, 0.0, 2.0);
  ASSERT_EQ(node.health(), HealthState::kOk);
  const auto small = [](Frame& f, double) { return (f.width = 640) > 0; };
  player.play(node, 2.05, 2.5, {}, small);
  EXPECT_EQ(node.health(), HealthState::kDegraded);
  EXPECT_THAT(node.status(), HasSubstr("frames of cam0 are 640×480"));
  EXPECT_THAT(node.status(), HasSubstr("752×480"));
  EXPECT_GT(node.reasons().of("frame_size_differs"), 5u);
  player.play(node, 2.55, 4.0);
  EXPECT_EQ(node.status(), "") << "well again";

  Node never(Config{}, 5, {});
  never.onCalibration(calibration());
  player.play(never, 0.0, 1.0, {}, small);
  EXPECT_EQ(never.health(), HealthState::kDegraded);
  EXPECT_THAT(never.status(), HasSubstr("640×480"));
}

TEST(VioNodeHealth, SaysThatTheAccelerationsAreInAnotherUnit) {
  Node node(Config{}, 5, {});
  node.onCalibration(calibration());
  Player player(3.0, 0.0);
  std::string status;  // status at the first attempt that detects the fault
  player.play(node, 0.0, 3.0, [&](ImuSample& sample, double) {
    sample.accel /= 9.80665;
    if (status.empty() && node.reasons().of("start_force_not_gravity") > 0) status = node.status();
    return true;
  });
  EXPECT_FALSE(node.started());
  EXPECT_THAT(status, HasSubstr("m/s²"));
}

TEST(VioNodeHealth, SaysWhatItWaitsFor) {
  Recorder r;
  Node node(Config{}, 5, r.outputs());
  EXPECT_NE(node.status().find("calibration"), std::string::npos);
  node.onCalibration(calibration());
  EXPECT_NE(node.status().find("inertial"), std::string::npos);
  EXPECT_EQ(node.health(), HealthState::kStarting);
  EXPECT_TRUE(node.saveState().empty());
  EXPECT_EQ(node.restoreState("nonsense").error().code, "state_malformed");
}

TEST(VioNodeHealth, SaysThatTheImagesContradictTheImu) {
  Player player(8.0);
  const auto playTo = [&](Node& node, const Calibration& rig, const Player::EditImu& edit) {
    node.onCalibration(rig);
    player.play(node, 0.0, 8.0, edit);
    return node.reasons().of("images_contradict_imu");
  };
  Calibration inverted = calibration();
  RigidTransform& T_BC = inverted.cameras[0].T_BC;
  T_BC = T_BC.inverse();
  Node of_inverted(Config{}, 5, {});
  EXPECT_GT(playTo(of_inverted, inverted, {}), 40u);
  EXPECT_EQ(of_inverted.health(), HealthState::kDegraded);
  EXPECT_THAT(of_inverted.status(), HasSubstr("T_BS"));

  Node right(Config{}, 5, {});
  EXPECT_EQ(playTo(right, calibration(), {}), 0u);
  EXPECT_EQ(right.health(), HealthState::kOk);
  EXPECT_EQ(right.status(), "");
}

}  // namespace
}  // namespace perdure::vio
