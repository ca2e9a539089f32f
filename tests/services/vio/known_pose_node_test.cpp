// Tests the node with poses from another program: its inputs, their faults, its messages.
#include "services/vio/known_pose_node.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <map>

#include "common/math/so3.h"
#include "tests/services/vio/drawn_drive.h"
#include "tests/services/vio/simulated_drive.h"

namespace perdure::vio {
namespace {

constexpr double kStep = 0.05;

test::DriveOptions driveOf(bool stereo) {
  test::DriveOptions options;
  options.points = 400;
  options.stereo = stereo;
  return options;
}

Calibration calibrationOf(const test::SimulatedDrive& drive) {
  Calibration c;
  for (const CameraModel& model : drive.cameras()) c.cameras.push_back(model.calibration());
  return c;
}

class KnownPoses : public ::testing::Test {
 protected:
  explicit KnownPoses(bool stereo = false)
      : drive_(driveOf(stereo)),
        node_({}, 5, [this](const Landmarks& l) { landmarks_[l.stamp.sequence] = l; }) {
    node_.onCalibration(calibrationOf(drive_));
  }

  Odometry poseOf(std::uint64_t frame) const {
    const double t = timeOf(frame);
    Odometry o;
    o.stamp = {1, frame, drive_.time(t), 0};
    o.world = {9, 0};
    o.state = OdometryState::kTracking;
    o.T_WB = drive_.truth(t).T_WB();
    o.v_WB = drive_.truth(t).v_WB;
    o.covariance = 1e-6 * Matrix9d::Identity();
    return o;
  }
  Frame imageOf(std::uint64_t frame, std::size_t camera = 0) const {
    return test::drawn(drive_, timeOf(frame), frame, camera);
  }
  void play(std::uint64_t from, std::uint64_t until) {
    for (std::uint64_t i = from; i < until; ++i) {
      node_.onFrame(imageOf(i));
      node_.onOdometry(poseOf(i));
    }
  }
  /// Median distance of a frame's landmarks from the nearest point of the drive, relative to their
  /// distance from the body.
  double errorAt(std::uint64_t frame) const {
    std::vector<double> errors;
    for (const Landmark& l : landmarks_.at(frame).landmarks) {
      double nearest = 1e9;
      for (const auto& p : drive_.points()) nearest = std::min(nearest, (p - l.p_W).norm());
      errors.push_back(nearest / (l.p_W - drive_.truth(timeOf(frame)).p_WB).norm());
    }
    if (errors.empty()) return 1.0;
    std::sort(errors.begin(), errors.end());
    return errors[errors.size() / 2];
  }
  static double timeOf(std::uint64_t frame) { return kStep * static_cast<double>(frame); }

  test::SimulatedDrive drive_;
  std::map<std::uint64_t, Landmarks> landmarks_;
  KnownPoseNode node_;
};

class KnownPosesInStereo : public KnownPoses {
 protected:
  KnownPosesInStereo() : KnownPoses(true) {}
};

TEST_F(KnownPoses, EachFrameWithAPoseGivesItsLandmarks) {
  play(0, 40);
  ASSERT_EQ(landmarks_.size(), 40u);
  EXPECT_GT(landmarks_.at(39).landmarks.size(), 20u);
  EXPECT_LT(errorAt(39), 0.03);
  const Landmarks& last = landmarks_.at(39);
  EXPECT_EQ(last.camera, "cam0");
  EXPECT_EQ(last.instance, 5u);
  EXPECT_EQ(last.world, (WorldId{9, 0}));
  EXPECT_TRUE(std::any_of(last.landmarks.begin(), last.landmarks.end(), [](const Landmark& l) {
    return l.descriptor != std::array<std::uint8_t, 32>{};
  }));
  EXPECT_EQ(node_.health(), HealthState::kOk);
  EXPECT_EQ(node_.status(), "");
  EXPECT_TRUE(node_.reasons().all().empty());
}

TEST_F(KnownPoses, PosesMayComeBeforeOrLongAfterTheirFrames) {
  for (std::uint64_t i = 0; i < 20; ++i) node_.onOdometry(poseOf(i));
  for (std::uint64_t i = 0; i < 20; ++i) node_.onFrame(imageOf(i));
  EXPECT_EQ(landmarks_.size(), 20u);
  for (std::uint64_t i = 20; i < 40; ++i) node_.onFrame(imageOf(i));
  EXPECT_EQ(landmarks_.size(), 20u);
  for (std::uint64_t i = 20; i < 40; ++i) node_.onOdometry(poseOf(i));
  EXPECT_EQ(landmarks_.size(), 40u);
  EXPECT_LT(errorAt(39), 0.03);
}

TEST_F(KnownPoses, AFrameWithoutAPoseIsCountedAndTheNextOneGoesOn) {
  play(0, 20);
  node_.onFrame(imageOf(20));
  play(21, 30);
  EXPECT_EQ(node_.reasons().of("frame_without_pose"), 1u);
  EXPECT_EQ(landmarks_.count(20), 0u);
  EXPECT_LT(errorAt(29), 0.03);
}

TEST_F(KnownPoses, WherePosesStopHealthSaysSo) {
  play(0, 20);
  for (std::uint64_t i = 20; i < 90; ++i) node_.onFrame(imageOf(i));
  EXPECT_EQ(node_.health(), HealthState::kDegraded);
  EXPECT_NE(node_.status().find("odometry"), std::string::npos);
  EXPECT_EQ(node_.reasons().of("frame_without_pose"), 30u) << "40 may still get theirs";
  node_.onOdometry(poseOf(89));
  EXPECT_EQ(landmarks_.count(89), 1u);
  EXPECT_EQ(node_.health(), HealthState::kOk);
}

TEST_F(KnownPoses, PosesThatAreNoneAreNotUsed) {
  for (std::uint64_t i = 0; i < 5; ++i) {
    Odometry o = poseOf(i);
    o.state = OdometryState::kInitialising;
    node_.onOdometry(o);
    node_.onFrame(imageOf(i));
  }
  Odometry broken = poseOf(5);
  broken.T_WB.p.x() = std::nan("");
  node_.onOdometry(broken);
  node_.onFrame(imageOf(5));
  EXPECT_TRUE(landmarks_.empty());
  EXPECT_EQ(node_.reasons().of("odometry_not_finite"), 1u);
  EXPECT_EQ(node_.health(), HealthState::kStarting);
  play(6, 20);
  EXPECT_LT(errorAt(19), 0.03);
}

TEST_F(KnownPoses, AnotherFrameOfReferenceBeginsAnew) {
  play(0, 20);
  ASSERT_GT(landmarks_.at(19).landmarks.size(), 20u);
  const RigidTransform moved(Eigen::Matrix3d::Identity(), Eigen::Vector3d(50.0, 0.0, 0.0));
  for (std::uint64_t i = 20; i < 40; ++i) {
    Odometry o = poseOf(i);
    o.world.epoch = 1;
    o.T_WB = moved * o.T_WB;
    node_.onOdometry(o);
    node_.onFrame(imageOf(i));
  }
  EXPECT_TRUE(landmarks_.at(20).landmarks.empty());
  ASSERT_GT(landmarks_.at(39).landmarks.size(), 20u);
  for (const Landmark& l : landmarks_.at(39).landmarks) EXPECT_GT(l.p_W.x(), 40.0);
}

TEST_F(KnownPoses, WhatDoesNotFitIsCounted) {
  KnownPoseNode early({}, 5, [](const Landmarks&) {});
  early.onFrame(imageOf(0));
  EXPECT_EQ(early.reasons().of("frame_before_calibration"), 1u);
  EXPECT_NE(early.status().find("calibration"), std::string::npos);
  Frame small = imageOf(0);
  small.width = 100;
  node_.onFrame(small);
  EXPECT_EQ(node_.reasons().of("frame_size_differs"), 1u);
  play(0, 3);
  node_.onFrame(imageOf(1));
  EXPECT_EQ(node_.reasons().of("frame_late"), 1u);
  node_.onOdometry(poseOf(1));
  EXPECT_EQ(node_.reasons().of("odometry_late"), 1u);
}

TEST_F(KnownPoses, AClockThatJumpsBackBeginsAnew) {
  play(0, 20);
  // The drive is repeated with continued sequence numbers. In the first lap the frame comes first,
  // in the second the pose.
  for (const std::uint64_t lap : {1, 2}) {
    for (std::uint64_t i = 0; i < 20; ++i) {
      Frame frame = imageOf(i);
      Odometry pose = poseOf(i);
      frame.stamp.sequence = pose.stamp.sequence = 100 * lap + i;
      if (lap == 1) node_.onFrame(frame);
      node_.onOdometry(pose);
      if (lap == 2) node_.onFrame(frame);
    }
    EXPECT_EQ(node_.reasons().of("clock_jumped_back"), lap);
    EXPECT_EQ(landmarks_.size(), 20 * (lap + 1));
    EXPECT_GT(landmarks_.at(100 * lap + 19).landmarks.size(), 20u);
  }
  EXPECT_EQ(node_.health(), HealthState::kOk);
}

TEST_F(KnownPoses, AStampFarAheadDoesNotStopIt) {
  play(0, 10);
  Odometry ahead = poseOf(10);
  ahead.stamp.time += std::chrono::hours(1);
  node_.onOdometry(ahead);
  play(11, 20);
  Frame frame = imageOf(20);
  frame.stamp.time += std::chrono::hours(1);
  node_.onFrame(frame);
  play(21, 40);
  EXPECT_GE(landmarks_.size(), 36u) << "a frame or two are lost";
  EXPECT_LT(errorAt(39), 0.03);
}

TEST_F(KnownPoses, FramesThatWaitFromAnEarlierRunDoNotTakeTheRoom) {
  for (std::uint64_t i = 60; i < 140; ++i) node_.onFrame(imageOf(i));
  for (std::uint64_t i = 0; i < 20; ++i) node_.onFrame(imageOf(i));
  for (std::uint64_t i = 0; i < 20; ++i) node_.onOdometry(poseOf(i));
  EXPECT_EQ(landmarks_.size(), 20u);
}

TEST_F(KnownPoses, HealthIsNotOkWhereNothingGoesOut) {
  const auto playBroken = [&](std::uint64_t from, auto change) {
    play(from, from + 10);
    EXPECT_EQ(node_.health(), HealthState::kOk);
    for (std::uint64_t i = from + 10; i < from + 30; ++i) {
      Frame frame = imageOf(i);
      Odometry pose = poseOf(i);
      change(frame, pose);
      node_.onOdometry(pose);
      node_.onFrame(frame);
    }
    EXPECT_EQ(node_.health(), HealthState::kDegraded);
    return node_.status();
  };
  using ::testing::HasSubstr;
  EXPECT_THAT(playBroken(0, [](Frame& f, Odometry&) { f.data = nullptr; }), HasSubstr("images"));
  EXPECT_THAT(playBroken(30, [](Frame& f, Odometry&) { f.width /= 2; }), HasSubstr("size"));
  EXPECT_THAT(playBroken(60, [](Frame&, Odometry& o) { o.state = OdometryState::kInitialising; }),
              HasSubstr("no start"));
  EXPECT_THAT(playBroken(90, [](Frame&, Odometry& o) { o.stamp.sequence += 1000; }),
              HasSubstr("no pose"));
}

/// Rotation of a camera relative to its calibration, about the body's axes.
RigidTransform turned(double x_deg, double y_deg, double z_deg) {
  const Eigen::Vector3d turn(x_deg, y_deg, z_deg);
  return {expQuaternion(turn * (M_PI / 180.0)).toRotationMatrix(), Eigen::Vector3d::Zero()};
}

TEST_F(KnownPoses, SaysThatThePosesAreOfAnotherBody) {
  const std::array<RigidTransform, 4> axes{turned(45, 0, 0), turned(0, 0, 90), turned(0, 0, 180),
                                           turned(0, 90, 0)};
  for (const RigidTransform& wrong : axes) {
    Calibration calibration = calibrationOf(drive_);
    calibration.cameras[0].T_BC = wrong * calibration.cameras[0].T_BC;
    KnownPoseNode node({}, 5, [](const Landmarks&) {});
    node.onCalibration(calibration);
    for (std::uint64_t i = 0; i < 80; ++i) {
      node.onFrame(imageOf(i));
      node.onOdometry(poseOf(i));
    }
    EXPECT_EQ(node.health(), HealthState::kDegraded);
    EXPECT_THAT(node.status(), ::testing::HasSubstr("T_BS"));
    EXPECT_GT(node.reasons().of("poses_contradict_images"), 10u);
  }
  play(0, 120);
  EXPECT_EQ(node_.status(), "") << "the right ones";
}

TEST_F(KnownPoses, IsWellAgainOnceThePosesAre) {
  for (std::uint64_t i = 0; i < 160; ++i) {
    Odometry pose = poseOf(i);
    if (i < 80) pose.T_WB = pose.T_WB.inverse();
    node_.onFrame(imageOf(i));
    node_.onOdometry(pose);
    if (i == 79) {
      EXPECT_THAT(node_.status(), ::testing::HasSubstr("T_WB"));
    }
  }
  EXPECT_EQ(node_.status(), "");
}

TEST_F(KnownPoses, SaysThatThePosesAreInAnotherUnit) {
  for (std::uint64_t i = 0; i < 80; ++i) {
    Odometry pose = poseOf(i);
    pose.T_WB.p *= 1000.0;
    node_.onFrame(imageOf(i));
    node_.onOdometry(pose);
  }
  EXPECT_EQ(node_.health(), HealthState::kDegraded);
  EXPECT_THAT(node_.status(), ::testing::HasSubstr("in metres"));
}

TEST_F(KnownPoses, WhatStandsAndSeesThingsMoveHasNoWrongPoses) {
  for (std::uint64_t i = 0; i < 80; ++i) {
    Odometry pose = poseOf(i);
    pose.T_WB = poseOf(0).T_WB;
    node_.onFrame(imageOf(i));
    node_.onOdometry(pose);
  }
  EXPECT_EQ(node_.status(), "") << "traffic that fills the picture";
}

TEST_F(KnownPoses, SaysFromTheStartThatFramesHaveAnotherSize) {
  for (std::uint64_t i = 0; i < 3; ++i) {
    Frame small = imageOf(i);
    small.width = 640;
    node_.onFrame(small);
  }
  EXPECT_EQ(node_.health(), HealthState::kDegraded);
  EXPECT_THAT(node_.status(), ::testing::HasSubstr("frames of cam0 are 640×480"));
}

TEST_F(KnownPosesInStereo, TellsWhichFrameStillWaits) {
  EXPECT_FALSE(node_.waitsFor());
  // The second camera is unplugged. Its images may still arrive until several frames have come
  // without them.
  for (std::uint64_t i = 0; i < 10; ++i) {
    node_.onOdometry(poseOf(i));
    node_.onFrame(imageOf(i));
    ASSERT_TRUE(node_.waitsFor());
    EXPECT_EQ(*node_.waitsFor(), landmarks_.size());
    EXPECT_LE(i - *node_.waitsFor(), 3u);
  }
  node_.flush();
  EXPECT_FALSE(node_.waitsFor());
  EXPECT_EQ(landmarks_.size(), 10u);
  EXPECT_EQ(node_.health(), HealthState::kDegraded);
  EXPECT_THAT(node_.status(), ::testing::HasSubstr("one camera"));
  // From here on the node does not wait for the second camera until its images return.
  play(10, 12);
  EXPECT_EQ(landmarks_.size(), 12u);
  for (std::uint64_t i = 11; i < 14; ++i) {
    if (i > 11) play(i, i + 1);
    node_.onFrame(imageOf(i, 1));
  }
  EXPECT_EQ(landmarks_.size(), 14u);
  EXPECT_EQ(node_.reasons().of("frame_late"), 1u);
  EXPECT_EQ(node_.reasons().of("stereo_unpaired"), 12u);
  EXPECT_EQ(node_.status(), "");
}

TEST_F(KnownPosesInStereo, ABodyThatStandsKnowsDistances) {
  for (std::uint64_t i = 0; i < 6; ++i) {
    Odometry o = poseOf(0);
    o.stamp = {1, i, drive_.time(timeOf(i)), 0};
    node_.onOdometry(o);
    for (std::size_t camera : {0u, 1u}) {
      Frame frame = imageOf(0, camera);
      frame.stamp = o.stamp;
      node_.onFrame(frame);
    }
  }
  ASSERT_EQ(landmarks_.size(), 6u);
  EXPECT_GT(landmarks_.at(5).landmarks.size(), 10u);
  EXPECT_LT(errorAt(5), 0.1);
  EXPECT_EQ(node_.reasons().of("stereo_unpaired"), 0u);
}

}  // namespace
}  // namespace perdure::vio
