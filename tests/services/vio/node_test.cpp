// Tests the node with images: starts, faults of its inputs, restarts.
#include "services/vio/node.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "common/math/gaussian.h"
#include "common/vision/image.h"
#include "services/vio/core/tracks/descriptor.h"
#include "tests/services/vio/player.h"

namespace perdure::vio {
namespace {

using ::testing::HasSubstr;
using namespace test;

TEST(VioNode, StartsAtRestWithinASecondAndFollowsTheDrive) {
  Recorder r;
  Node node(Config{}, 5, r.outputs());
  node.onCalibration(calibration());
  Player player(6.0);
  player.play(node, 0.0, 6.0);
  node.flush();
  ASSERT_GT(usable(r), 100u);
  const auto first = std::find_if(r.odometry.begin(), r.odometry.end(), [](const Odometry& o) {
    return o.state != OdometryState::kInitialising;
  });
  EXPECT_LT(toSeconds(first->stamp.time - player.drive().time(0.0)), 0.8);
  const Odometry& last = r.odometry.back();
  const double t = toSeconds(last.stamp.time - player.drive().time(0.0));
  const Nav truth = player.drive().truth(t), begin = player.drive().truth(0.5);
  EXPECT_NEAR(travelled(last, *first), (truth.p_WB - begin.p_WB).norm(), 0.25);
  EXPECT_TRUE(isCovariance(last.covariance));
  EXPECT_TRUE(last.has_increment);
  EXPECT_EQ(last.increment_from + 1, last.stamp.sequence);
  EXPECT_GT(r.landmarks.back().landmarks.size(), 10u);
  EXPECT_NE(r.landmarks.back().landmarks.front().descriptor, Descriptor{});
  expectFinite(r);
}

TEST(VioNode, TwoRunsGiveIdenticalOutput) {
  Recorder a, b;
  for (Recorder* r : {&a, &b}) {
    Node node(Config{}, 5, r->outputs());
    node.onCalibration(calibration());
    Player(3.0).play(node, 0.0, 3.0);
    node.flush();
  }
  ASSERT_EQ(a.odometry.size(), b.odometry.size());
  for (std::size_t i = 0; i < a.odometry.size(); ++i) {
    EXPECT_EQ(a.odometry[i].T_WB.p, b.odometry[i].T_WB.p);
    EXPECT_EQ(a.odometry[i].covariance, b.odometry[i].covariance);
  }
}

TEST(VioNode, EveryFrameIsAnsweredOnceAndInOrder) {
  Recorder r;
  Node node(Config{}, 5, r.outputs());
  node.onCalibration(calibration());
  Player(2.0).play(node, 0.0, 2.0);
  node.flush();
  ASSERT_EQ(r.odometry.size(), 41u);
  for (std::size_t i = 0; i < r.odometry.size(); ++i) {
    EXPECT_EQ(r.odometry[i].stamp.sequence, i);
  }
}

/// Error of the motion between the times `from` and `to` of the drive, in metres.
double motionError(const Recorder& r, const SimulatedDrive& drive, double from, double to) {
  const auto at = [&](double t) {
    return *std::find_if(r.odometry.begin(), r.odometry.end(), [&](const Odometry& o) {
      return toSeconds(o.stamp.time - drive.time(t)) > -1e-6;
    });
  };
  const Odometry a = at(from), b = at(to);
  EXPECT_EQ(a.world, b.world) << "not the same frame of reference";
  const Nav true_a = drive.truth(from), true_b = drive.truth(to);
  const Eigen::Vector3d moved = a.T_WB.R().transpose() * (b.T_WB.p - a.T_WB.p);
  return (moved - true_a.q_WB.conjugate() * (true_b.p_WB - true_a.p_WB)).norm();
}

TEST(VioNode, BridgesAnInertialGapOfHalfASecondAndSaysSo) {
  Recorder r;
  Node node(Config{}, 5, r.outputs());
  node.onCalibration(calibration());
  Player player(6.0);
  player.play(node, 0.0, 6.0, [](ImuSample&, double t) { return t < 3.0 || t > 3.5; });
  node.flush();
  EXPECT_LT(motionError(r, player.drive(), 2.9, 6.0), 0.3);
  EXPECT_GE(node.reasons().of("imu_gap"), 1u);
  EXPECT_EQ(r.odometry.size(), 121u);
  EXPECT_TRUE(std::any_of(r.odometry.begin(), r.odometry.end(),
                          [](const Odometry& o) { return o.state == OdometryState::kDegraded; }));
  expectFinite(r);
}

TEST(VioNode, AnInertialGapThatIsTooLongBeginsANewEpoch) {
  Config config;
  config.longest_gap_s = 0.4;
  Recorder r;
  Node node(config, 5, r.outputs());
  node.onCalibration(calibration());
  Player(6.0).play(node, 0.0, 6.0, [](ImuSample&, double t) { return t < 2.5 || t > 3.1; });
  node.flush();
  EXPECT_EQ(node.reasons().of("imu_gap_too_long"), 1u);
  EXPECT_EQ(r.odometry.back().world.epoch, 1u);
  EXPECT_EQ(r.odometry.front().world.epoch, 0u);
  expectFinite(r);
}

TEST(VioNode, AnImuThatIsGoneForSecondsAtRestBeginsOneNewEpochAndNoMore) {
  Recorder r;
  Node node(Config{}, 5, r.outputs());
  node.onCalibration(calibration());
  Player(7.0, 7.0).play(node, 0.0, 7.0, [](ImuSample&, double t) { return t < 2.0 || t > 4.5; });
  node.flush();
  EXPECT_EQ(r.odometry.size(), 141u);
  EXPECT_EQ(r.odometry.back().world.epoch, 1u);
  EXPECT_EQ(r.odometry.back().state, OdometryState::kTracking);
  expectFinite(r);
}

TEST(VioNode, TakesNoForceFromASaturatedAccelerometer) {
  Recorder r;
  Node node(Config{}, 5, r.outputs());
  node.onCalibration(calibration());
  Player player(6.0);
  player.play(node, 0.0, 6.0, [](ImuSample& s, double t) {
    if (t > 3.0 && t < 3.3) s.accel = Eigen::Vector3d(19.6, -19.6, 19.6);
    return true;
  });
  node.flush();
  EXPECT_GT(node.reasons().of("imu_accel_saturated"), 50u);
  EXPECT_EQ(node.reasons().of("reset"), 0u);
  EXPECT_LT(motionError(r, player.drive(), 2.9, 6.0), 0.3);
  expectFinite(r);
}

TEST(VioNode, CarriesOnThroughTwoBlackSeconds) {
  Recorder r;
  Node node(Config{}, 5, r.outputs());
  node.onCalibration(calibration());
  Player player(7.0);
  cv::Mat black(480, 752, CV_8UC1, cv::Scalar(0));
  player.play(node, 0.0, 7.0, {}, [&](Frame& f, double t) {
    return t <= 3.0 || t >= 5.0 || vision::setPixels(f, black).has_value();
  });
  node.flush();
  EXPECT_EQ(node.reasons().of("reset"), 0u);
  EXPECT_EQ(r.odometry.size(), 141u);
  EXPECT_LT(motionError(r, player.drive(), 2.9, 7.0), 0.5);
  expectFinite(r);
}

TEST(VioNode, ASecondWithoutAnythingBeginsANewEpoch) {
  Recorder r;
  Node node(Config{}, 5, r.outputs());
  node.onCalibration(calibration());
  const auto seen = [](double t) { return t < 3.0 || t > 4.0; };
  Player(6.0).play(
      node, 0.0, 6.0, [&](ImuSample&, double t) { return seen(t); },
      [&](Frame&, double t) { return seen(t); });
  node.flush();
  EXPECT_EQ(node.reasons().of("clock_jumped_or_blackout"), 1u);
  EXPECT_EQ(r.odometry.back().world.epoch, 1u);
  expectFinite(r);
}

TEST(VioNode, CountsNotFiniteDoubledAndMisorderedInput) {
  Recorder r;
  Node node(Config{}, 5, r.outputs());
  node.onCalibration(calibration());
  Frame kept;
  Player(2.0).play(
      node, 0.0, 2.0,
      [&](ImuSample& s, double t) {
        if (std::abs(t - 1.0) < 1e-6) s.gyro.x() = std::nan("");
        if (std::abs(t - 1.5) < 1e-6) node.onImu(s);
        return true;
      },
      [&](Frame& f, double t) {
        if (std::abs(t - 1.0) < 1e-6) kept = f;
        if (std::abs(t - 1.2) < 1e-6) node.onFrame(kept);
        if (std::abs(t - 1.4) < 1e-6) node.onFrame(f);
        if (std::abs(t - 1.6) < 1e-6) f.data = nullptr;
        if (std::abs(t - 1.7) < 1e-6) f.width = 640;
        return true;
      });
  node.flush();
  EXPECT_EQ(node.reasons().of("imu_not_finite"), 1u);
  EXPECT_EQ(node.reasons().of("imu_duplicate"), 1u);
  EXPECT_EQ(node.reasons().of("frame_late"), 1u);
  EXPECT_EQ(node.reasons().of("frame_duplicate"), 1u);
  EXPECT_EQ(node.reasons().of("image_missing"), 1u);
  EXPECT_EQ(node.reasons().of("frame_size_differs"), 1u);
  expectFinite(r);
}

TEST(VioNode, ASpikeInTheInertialSamplesLeavesTheOutputFinite) {
  Recorder r;
  Node node(Config{}, 5, r.outputs());
  node.onCalibration(calibration());
  Player(5.0).play(node, 0.0, 5.0, [&](ImuSample& s, double t) {
    if (std::abs(t - 3.0) < 0.02) s.accel = Eigen::Vector3d::Constant(1e7 * (1.0 + t));
    return true;
  });
  node.flush();
  EXPECT_EQ(r.odometry.size(), 101u);
  EXPECT_GE(node.reasons().of("reset"), 1u);
  EXPECT_GE(r.odometry.back().world.epoch, 1u);
  expectFinite(r);
}

TEST(VioNode, FramesWithoutInertialSamplesAreGivenUpNotPiledUp) {
  Config config;
  config.max_pending = 10;
  Recorder r;
  Node node(config, 5, r.outputs());
  node.onCalibration(calibration());
  Player(2.0).play(node, 0.0, 2.0, [](ImuSample&, double) { return false; });
  EXPECT_EQ(node.reasons().of("frame_without_imu"), 31u);
  EXPECT_EQ(r.odometry.size(), 31u);
}

TEST(VioNode, ANewRunOfTheClockBeginsANewEpoch) {
  Recorder r;
  Node node(Config{}, 5, r.outputs());
  node.onCalibration(calibration());
  Player player(3.0);
  player.play(node, 0.0, 3.0);
  player.play(node, 0.0, 3.0);
  node.flush();
  EXPECT_EQ(node.reasons().of("clock_jumped_back"), 1u);
  EXPECT_EQ(r.odometry.back().world.epoch, 1u);
  EXPECT_NE(r.odometry.back().state, OdometryState::kInitialising);
}

TEST(VioNode, ResumesWhereAnotherProcessStopped) {
  Recorder before, after;
  Player player(6.0);
  Node first(Config{}, 5, before.outputs());
  first.setWorld({77, 2});
  first.onCalibration(calibration());
  player.play(first, 0.0, 4.0);
  const std::string saved = first.saveState();
  ASSERT_FALSE(saved.empty());

  Node second(Config{}, 6, after.outputs());
  ASSERT_TRUE(second.restoreState(saved));
  second.onCalibration(calibration());
  player.play(second, 3.5, 6.0, {}, [](Frame&, double t) { return t > 4.5; });
  second.flush();
  ASSERT_GT(usable(after), 20u);
  EXPECT_EQ(after.odometry.front().world, (WorldId{77, 2}));
  EXPECT_EQ(after.odometry.front().state, OdometryState::kDegraded);
  EXPECT_EQ(after.odometry.front().instance, 6u);
  // Half a second of inertial propagation alone, in the same W.
  const Nav a = player.drive().truth(4.0);
  const double t = toSeconds(after.odometry.front().stamp.time - player.drive().time(0.0));
  EXPECT_NEAR(travelled(before.odometry.back(), after.odometry.front()),
              (player.drive().truth(t).p_WB - a.p_WB).norm(), 0.1);
  const auto uncertainty = [](const Odometry& o) {
    return o.covariance.diagonal().segment<3>(3).sum();
  };
  EXPECT_GT(uncertainty(after.odometry.front()), uncertainty(before.odometry.back()));
  expectFinite(after);
}

TEST(VioNode, AnOldStateIsLeftAsideAndTheEpochGoesUp) {
  Recorder before, after;
  Player player(3.0);
  Node first(Config{}, 5, before.outputs());
  first.setWorld({77, 2});
  first.onCalibration(calibration());
  player.play(first, 0.0, 3.0);
  Config config;
  config.restore_age_s = 0.5;
  Node second(config, 6, after.outputs());
  ASSERT_TRUE(second.restoreState(first.saveState()));
  second.onCalibration(calibration());
  player.play(second, 0.0, 2.0);  // an earlier time, as in another run
  EXPECT_EQ(second.reasons().of("state_too_old"), 1u);
  EXPECT_EQ(after.odometry.back().world, (WorldId{77, 3}));
}

TEST(VioNode, AFrameOfTheRunBeforeThatComesLateDoesNotStayInTheWay) {
  Recorder r;
  Node node(Config{}, 5, r.outputs());
  node.onCalibration(calibration());
  Player player(3.0);
  player.play(node, 0.0, 2.0);
  const std::size_t before = r.odometry.size();
  player.play(node, 0.0, 2.0, {}, [&](Frame&, double t) {
    if (std::abs(t - 0.1) < 1e-6) node.onFrame(drawn(player.drive(), 2.05, 41));
    return true;
  });
  node.flush();
  EXPECT_EQ(node.reasons().of("clock_jumped_back"), 1u);
  EXPECT_EQ(node.reasons().of("frame_of_earlier_run"), 1u);
  EXPECT_EQ(node.reasons().of("frame_reordered"), 0u);
  EXPECT_EQ(r.odometry.back().stamp.sequence, 40u) << "the old one is none of this run";
  EXPECT_GE(r.odometry.size(), before + 39);
  EXPECT_EQ(node.status(), "");
}

TEST(VioNode, TheFirstCameraOfItsConfigurationLeads) {
  Calibration two = calibration();
  two.cameras.push_back(testCamera(1));
  auto options = restThenDrive();
  options.stereo = true;
  const SimulatedDrive both(options);
  for (const auto& cameras : std::vector<std::vector<std::string>>{{"cam1"}, {"cam1", "cam0"}}) {
    Config config;
    config.cameras = cameras;
    Recorder r;
    Node node(config, 5, r.outputs());
    node.onCalibration(two);
    Player player(4.0);
    player.play(node, 0.0, 4.0, {}, [&](Frame& f, double t) {
      const std::uint64_t k = f.stamp.sequence;
      node.onFrame(drawn(both, t, k, 1));
      f = drawn(both, t, k, 0);
      return true;
    });
    EXPECT_GT(usable(r), 40u);
    ASSERT_FALSE(r.landmarks.empty());
    EXPECT_EQ(r.landmarks.back().camera, "cam1");
    EXPECT_EQ(node.health(), HealthState::kOk) << node.status();
    const auto first = std::find_if(r.odometry.begin(), r.odometry.end(), [](const Odometry& o) {
      return o.state == OdometryState::kTracking;
    });
    ASSERT_NE(first, r.odometry.end());
    const Odometry& last = r.odometry.back();
    const auto truthAt = [&](const Odometry& o) {
      return both.truth(toSeconds(o.stamp.time - both.time(0.0))).p_WB;
    };
    EXPECT_NEAR(travelled(last, *first), (truthAt(last) - truthAt(*first)).norm(), 0.25);
  }
}

}  // namespace
}  // namespace perdure::vio
