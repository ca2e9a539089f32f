#include "tools/data_check/poses/pose_check.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "common/math/so3.h"
#include "tests/tools/data_check/turning_drive.h"
#include "tools/data_check/data_check.h"

namespace perdure::tools {
namespace {

using replay::DataFinding;
using replay::StampedPose;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;
using Poses = std::vector<StampedPose>;

std::vector<std::string> codesIn(const replay::DataFindings& findings) {
  std::vector<std::string> codes;
  for (const auto& finding : findings) codes.push_back(finding.code);
  return codes;
}

/// 20 s of rotation about all axes, or about z only like a vehicle, and of acceleration.
struct Way {
  replay::Recording recording;
  Poses poses;  ///< poses at 200 Hz
};

Way wayOf(const Eigen::Vector3d& turning) {
  constexpr double kStep_s = 0.005, kSeconds = 20.0;
  std::mt19937_64 random(7);
  std::normal_distribution<double> noise;
  Way way;
  CameraCalibration camera;
  camera.name = "cam0", camera.width = 640, camera.height = 480;
  camera.fx = camera.fy = 400, camera.cx = 320, camera.cy = 240;
  camera.T_BC = tests::trueCameraPlace();
  way.recording.calibration.cameras.push_back(camera);
  Eigen::Quaterniond q = expQuaternion({0.1, -0.2, 0.5});
  for (int i = 0; i * kStep_s < kSeconds; ++i) {
    const double t = i * kStep_s;
    const TimePoint time(durationFromSeconds(100.0 + t));
    const Eigen::Vector3d phase(5.1 * t, 4.3 * t + 1.0, 3.2 * t + 2.0);
    const Eigen::Vector3d rate = turning.cwiseProduct(phase.array().sin().matrix());
    const Eigen::Vector3d place(2.0 * t + std::sin(1.5 * t), std::cos(1.9 * t), 0.1 * t);
    const Eigen::Vector3d push(-2.25 * std::sin(1.5 * t), -3.61 * std::cos(1.9 * t), 0.0);
    way.poses.push_back({time, RigidTransform(q, place)});
    ImuSample sample;
    sample.time = time;
    sample.gyro = rate + Eigen::Vector3d(0.02, -0.05, 0.03);
    sample.accel = q.conjugate() * (push + Eigen::Vector3d(0, 0, 9.81));
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      sample.gyro[axis] += 0.005 * noise(random), sample.accel[axis] += 0.1 * noise(random);
    }
    way.recording.imu.push_back(sample);
    q = q * expQuaternion(kStep_s * rate);
  }
  return way;
}

const Way& phone() {
  static const Way way = wayOf({1.0, 0.8, 1.2});
  return way;
}
const Way& vehicle() {
  static const Way way = wayOf({0.01, 0.01, 0.3});
  return way;
}

Poses changed(Poses poses, const std::function<RigidTransform(const RigidTransform&)>& change) {
  for (auto& pose : poses) pose.T_WB = change(pose.T_WB);
  return poses;
}
Poses inverted(const Poses& poses) {
  return changed(poses, [](const RigidTransform& T) { return T.inverse(); });
}
Poses ofCamera(const Poses& poses) {
  return changed(poses, [](const RigidTransform& T) { return T * tests::trueCameraPlace(); });
}
/// The poses as they are read if the file has w first.
Poses withWFirst(const Poses& poses) {
  return changed(poses, [](const RigidTransform& T) {
    return RigidTransform(Eigen::Quaterniond(T.q.z(), T.q.w(), T.q.x(), T.q.y()), T.p);
  });
}
Poses inUnit(const Poses& poses, double metre) {
  return changed(poses, [&](const RigidTransform& T) {
    return RigidTransform(T.q, Eigen::Vector3d(metre * T.p));
  });
}
Poses eachOf(const Poses& poses, std::size_t n) {
  Poses some;
  for (std::size_t i = 0; i < poses.size(); i += n) some.push_back(poses[i]);
  return some;
}
Poses rough(const Poses& poses, double rad, double metre) {
  std::mt19937_64 random(3);
  std::normal_distribution<double> noise;
  const auto drawn = [&](double sigma) {
    const double x = noise(random), y = noise(random), z = noise(random);
    return Eigen::Vector3d(sigma * Eigen::Vector3d(x, y, z));
  };
  return changed(poses, [&](const RigidTransform& T) {
    return RigidTransform(T.q * expQuaternion(drawn(rad)), Eigen::Vector3d(T.p + drawn(metre)));
  });
}

replay::DataFindings findingsOf(const Way& way, const Poses& poses) {
  return checkPoses(way.recording, {replay::PoseFormat::kTum, poses}, {.images = false});
}

TEST(PoseCheck, SoundPosesHaveNoFinding) {
  for (const Way* way : {&phone(), &vehicle()}) {
    for (const std::size_t each : {1, 4, 20}) {  // 200, 50 and 10 Hz
      const Poses poses = eachOf(way->poses, each);
      EXPECT_THAT(codesIn(findingsOf(*way, poses)), ElementsAre());
      EXPECT_THAT(codesIn(findingsOf(*way, rough(poses, 0.005, 0.01))), ElementsAre());
      EXPECT_THAT(codesIn(findingsOf(*way, rough(poses, 0.05, 0.2))), ElementsAre());
    }
  }
}

TEST(PoseCheck, PosesTheWrongWayRoundAreNamed) {
  for (const Way* way : {&phone(), &vehicle()}) {
    const auto findings = findingsOf(*way, rough(inverted(way->poses), 0.005, 0.01));
    ASSERT_THAT(codesIn(findings), ElementsAre("poses_inverted"));
    EXPECT_EQ(findings[0].grade, DataFinding::Grade::kFatal);
    EXPECT_THAT(findings[0].text,
                AllOf(HasSubstr("otherwise than the gyroscope in"),
                      HasSubstr("the world in the body"), HasSubstr("give their inverse")));
  }
}

TEST(PoseCheck, PosesOfTheCameraAreNamed) {
  for (const Way* way : {&phone(), &vehicle()}) {
    const auto findings = findingsOf(*way, ofCamera(way->poses));
    ASSERT_THAT(codesIn(findings), ElementsAre("poses_of_camera"));
    EXPECT_THAT(findings[0].text, HasSubstr("T_WC times the inverse of T_BS"));
    EXPECT_THAT(codesIn(findingsOf(*way, inverted(ofCamera(way->poses)))),
                ElementsAre("poses_inverted"));
  }
}

TEST(PoseCheck, AQuaternionWithWFirstIsNamed) {
  for (const Way* way : {&phone(), &vehicle()}) {
    const auto findings = findingsOf(*way, withWFirst(way->poses));
    ASSERT_THAT(codesIn(findings), ElementsAre("poses_w_first"));
    EXPECT_THAT(findings[0].text, HasSubstr("qx qy qz qw"));
  }
}

TEST(PoseCheck, OtherAxesAreTold) {
  const Eigen::Quaterniond down(0, 1, 0, 0);  // x forward, y right, z down
  const auto findings = findingsOf(phone(), changed(phone().poses, [&](const RigidTransform& T) {
                                     return RigidTransform(T.q * down, T.p);
                                   }));
  ASSERT_THAT(codesIn(findings), ElementsAre("poses_other_axes"));
  EXPECT_THAT(findings[0].text, HasSubstr("x is x, y is -y, z is -z"));
}

TEST(PoseCheck, TheUnitOfLengthIsToldByTheAccelerometer) {
  const auto textAt = [](double metre) {
    const auto findings = findingsOf(phone(), inUnit(phone().poses, metre));
    return findings.empty() ? std::string() : findings[0].code + ": " + findings[0].text;
  };
  EXPECT_THAT(textAt(100.0), AllOf(HasSubstr("poses_unit"), HasSubstr("centimetres; multiply x, "
                                                                      "y, z by 0.01")));
  EXPECT_THAT(textAt(1000.0), HasSubstr("millimetres"));
  EXPECT_THAT(textAt(0.001), HasSubstr("kilometres; multiply x, y, z by 1000"));
  EXPECT_THAT(textAt(1.0 / 0.3048), HasSubstr("feet; multiply x, y, z by 0.3048"));
  EXPECT_EQ(textAt(1.3), "");
}

TEST(PoseCheck, AScaleThatIsNoUnitIsToldWithItsSpread) {
  for (const double metre : {0.2, 0.65, 1.6, 2.5, 4.0, 70.0, 1400.0}) {
    const auto findings = findingsOf(phone(), inUnit(phone().poses, metre));
    ASSERT_THAT(codesIn(findings), ElementsAre("poses_unit")) << metre;
    EXPECT_EQ(findings[0].grade, DataFinding::Grade::kWarning) << metre;
    EXPECT_THAT(findings[0].text,
                AllOf(HasSubstr("which is no unit"), HasSubstr("no scale of their own")));
  }
}

TEST(PoseCheck, FeetAreNamedOnlyWhereNoOtherScaleIsAsLikely) {
  const Poses poses = inUnit(rough(eachOf(phone().poses, 20), 0.02, 0.15), 1.0 / 0.3048);
  const auto findings = findingsOf(phone(), poses);
  ASSERT_THAT(codesIn(findings), ElementsAre("poses_unit"));
  EXPECT_EQ(findings[0].grade, DataFinding::Grade::kWarning);
  EXPECT_THAT(findings[0].text, HasSubstr("which may be feet"));
}

Poses conjugated(const Poses& poses) {
  return changed(poses,
                 [](const RigidTransform& T) { return RigidTransform(T.q.conjugate(), T.p); });
}
/// Changes only the positions.
Poses moved(const Poses& poses, const std::function<Eigen::Vector3d(const Eigen::Vector3d&)>& to) {
  return changed(poses, [&](const RigidTransform& T) { return RigidTransform(T.q, to(T.p)); });
}

TEST(PoseCheck, AConjugatedQuaternionIsNoInversePose) {
  for (const bool imu : {true, false}) {
    const Poses poses = rough(conjugated(phone().poses), 0.005, 0.01);
    replay::Recording recording = phone().recording;
    if (!imu) recording.imu.clear();
    EXPECT_EQ(howInverted(poses, recording, false), Inversion::kQuaternion) << imu;
    EXPECT_EQ(howInverted(inverted(phone().poses), recording, false), Inversion::kPose) << imu;
  }
  for (const Way* way : {&phone(), &vehicle()}) {
    const auto findings = findingsOf(*way, conjugated(way->poses));
    ASSERT_THAT(codesIn(findings), ElementsAre("poses_conjugated"));
    EXPECT_THAT(findings[0].text,
                AllOf(HasSubstr("conjugate the quaternions"), Not(HasSubstr("inverse"))));
  }
}

TEST(PoseCheck, WhatCannotBeToldFromPositionsIsNamedBothWays) {
  const auto still = [](const Eigen::Vector3d&) { return Eigen::Vector3d(0, 0, 0); };
  const auto findings = findingsOf(phone(), conjugated(moved(phone().poses, still)));
  ASSERT_THAT(codesIn(findings), ElementsAre("poses_inverted"));
  EXPECT_THAT(findings[0].text, AllOf(HasSubstr("give their inverse"), HasSubstr("else conjugate "
                                                                                 "the")));
}

TEST(PoseCheck, OrientationsThatStayWhileTheGyroscopeTurnsAreRefused) {
  const Poses poses = changed(phone().poses, [](const RigidTransform& T) {
    return RigidTransform(Eigen::Quaterniond::Identity(), T.p);
  });
  const auto findings = findingsOf(phone(), poses);
  ASSERT_THAT(codesIn(findings), ElementsAre("poses_without_turning"));
  EXPECT_EQ(findings[0].grade, DataFinding::Grade::kFatal);
  Way at_rest = wayOf({0.0, 0.0, 0.0});
  EXPECT_THAT(codesIn(findingsOf(at_rest, at_rest.poses)), ElementsAre());
}

TEST(PoseCheck, PositionsThatStayAreRefusedUnlessTheBodyStands) {
  const auto stay = [](const Eigen::Vector3d&) { return Eigen::Vector3d(3, 2, 1); };
  EXPECT_THAT(codesIn(findingsOf(phone(), moved(phone().poses, stay))),
              ElementsAre("poses_without_positions"));
  Way on_the_spot = phone();
  const Eigen::Vector3d up(0, 0, 9.81);
  for (std::size_t i = 0; i < on_the_spot.poses.size(); ++i) {
    on_the_spot.recording.imu[i].accel = on_the_spot.poses[i].T_WB.q.conjugate() * up;
  }
  EXPECT_THAT(codesIn(findingsOf(on_the_spot, moved(phone().poses, stay))), ElementsAre());
}

TEST(PoseCheck, PositionsOfAnotherWorldThanTheOrientationsAreTold) {
  const auto textOf = [](const std::function<Eigen::Vector3d(const Eigen::Vector3d&)>& to) {
    const auto findings = findingsOf(phone(), moved(phone().poses, to));
    return findings.empty() ? std::string() : findings[0].code + ": " + findings[0].text;
  };
  EXPECT_THAT(textOf([](const auto& p) { return Eigen::Vector3d(-p.x(), p.y(), p.z()); }),
              AllOf(HasSubstr("poses_other_position_axes"), HasSubstr("write -x, y, z")));
  EXPECT_THAT(textOf([](const auto& p) { return Eigen::Vector3d(p.y(), p.x(), -p.z()); }),
              AllOf(HasSubstr("write y, x, z"), HasSubstr("of z the drive shows too little")));
}

TEST(PoseCheck, DegreesOfLatitudeAndLongitudeAreToldByTheAccelerometer) {
  const auto findings =
      findingsOf(phone(), moved(phone().poses, [](const auto& p) {
                   return Eigen::Vector3d(48.0 + p.y() / 111200.0, 11.0 + p.x() / 74408.0, p.z());
                 }));
  ASSERT_THAT(codesIn(findings), ElementsAre("poses_in_degrees"));
  EXPECT_THAT(findings[0].text, HasSubstr("are latitude and longitude"));
}

TEST(PoseCheck, AJumpBetweenNeighboursIsToldOnce) {
  Poses poses = eachOf(phone().poses, 10);
  for (std::size_t i = 100; i < poses.size(); ++i) {
    poses[i].T_WB = poses[0].T_WB.inverse() * poses[i].T_WB;
  }
  for (std::size_t i = 200; i < poses.size(); ++i) poses[i].T_WB.p.x() += 3.0;
  const auto findings = findingsOf(phone(), poses);
  ASSERT_THAT(codesIn(findings), ElementsAre("poses_jump"));
  EXPECT_THAT(findings[0].text,
              AllOf(HasSubstr("(poses 100 and 101 of them), and 1 times more"), HasSubstr("cut")));
}

TEST(PoseCheck, APauseIsNoJump) {
  Poses poses = eachOf(phone().poses, 10);
  poses.erase(poses.begin() + 100, poses.begin() + 140);  // a gap of 2 s and 4 m
  EXPECT_THAT(codesIn(findingsOf(phone(), poses)), ElementsAre());
}

/// A vehicle that drives a curve of 100 m in the direction of its x, without inertial samples.
Way curve(double yaw) {
  Way way = phone();
  way.recording.imu.clear();
  way.poses.clear();
  Eigen::Vector3d p = Eigen::Vector3d::Zero();
  for (int i = 0; i < 200; ++i) {
    const double heading = yaw * i / 200.0;
    const Eigen::Quaterniond q(Eigen::AngleAxisd(heading, Eigen::Vector3d::UnitZ()));
    way.poses.push_back({TimePoint(durationFromSeconds(100.0 + 0.1 * i)), RigidTransform(q, p)});
    p += q * Eigen::Vector3d(0.5, 0.0, 0.0);
  }
  return way;
}

TEST(PoseCheck, PosesOfACameraAreToldByTheirDirectionOfMotion) {
  for (const double yaw : {0.0, 0.4, 3.0, 9.0}) {
    const Way way = curve(yaw);
    EXPECT_THAT(codesIn(findingsOf(way, way.poses)), ElementsAre()) << yaw;
    const RigidTransform first = tests::trueCameraPlace().inverse();  // KITTI: of the first camera
    const auto in_first = [&](const RigidTransform& T) { return first * T; };
    for (const Poses& poses : {ofCamera(way.poses), changed(ofCamera(way.poses), in_first)}) {
      const auto findings = findingsOf(way, poses);
      ASSERT_THAT(codesIn(findings), ElementsAre("poses_of_camera")) << yaw;
      EXPECT_EQ(findings[0].grade, DataFinding::Grade::kFatal);
      EXPECT_THAT(findings[0].text, HasSubstr("--odometry-of camera"));
    }
    EXPECT_THAT(codesIn(findingsOf(way, changed(way.poses, in_first))), ElementsAre()) << yaw;
  }
}

TEST(PoseCheck, PosesOfACameraOnAShortStraightWayAreToldByTheAccelerometer) {
  Way way = wayOf({0.0, 0.0, 0.0});
  EXPECT_THAT(codesIn(findingsOf(way, way.poses)), ElementsAre());
  const auto findings = findingsOf(way, ofCamera(way.poses));
  ASSERT_THAT(codesIn(findings), ElementsAre("poses_of_camera"));
  EXPECT_EQ(findings[0].grade, DataFinding::Grade::kFatal);
}

TEST(PoseCheck, InvertedPosesOfAStraightWayMoveBackwards) {
  Way way = wayOf({0.0, 0.0, 0.0});
  SpeedSample speed;
  speed.time = way.poses.front().time, speed.speed = 5.0;
  way.recording.speed.push_back(speed);
  for (std::size_t i = 0; i < way.poses.size(); ++i) {
    way.poses[i].T_WB =
        RigidTransform(Eigen::Quaterniond::Identity(), {0.02 * static_cast<double>(i), 0.0, 0.0});
  }
  EXPECT_THAT(codesIn(judgePosesBackwards(way.poses, way.recording)), ElementsAre());
  for (auto& pose : way.poses) pose.T_WB = pose.T_WB.inverse();
  EXPECT_THAT(codesIn(judgePosesBackwards(way.poses, way.recording)),
              ElementsAre("poses_backwards"));
}

TEST(PoseCheck, PosesThatStandStillWhileTheBodyMovesAreToldWithTheTime) {
  const Poses sound = eachOf(phone().poses, 10);
  for (const std::size_t last : {sound.size(), std::size_t{230}}) {
    Poses poses = sound;
    for (std::size_t i = 200; i < last; ++i) poses[i].T_WB = poses[200].T_WB;
    const auto findings = findingsOf(phone(), poses);
    ASSERT_THAT(codesIn(findings), ElementsAre("poses_frozen"));
    EXPECT_THAT(findings[0].text, AllOf(HasSubstr(std::to_string(toNanoseconds(poses[200].time))),
                                        HasSubstr(fmt::format("poses 201 to {} of them", last)),
                                        HasSubstr("while the gyroscope turns")));
  }
}

TEST(PoseCheck, PartsOfPosesThatStandStillAreNamed) {
  const Poses sound = eachOf(phone().poses, 10);
  Poses poses = sound;
  for (std::size_t i = 200; i < 230; ++i) poses[i].T_WB.q = poses[200].T_WB.q;
  auto findings = findingsOf(phone(), poses);
  ASSERT_THAT(codesIn(findings), ElementsAre("poses_frozen"));
  EXPECT_THAT(findings[0].text, HasSubstr("the orientations of the poses stand still"));
  Way way = phone();
  SpeedSample speed;
  speed.time = sound[215].time, speed.speed = 2.0;
  way.recording.speed = {speed};
  poses = sound;
  for (std::size_t i = 200; i < 230; ++i) poses[i].T_WB.p = poses[200].T_WB.p;
  findings = findingsOf(way, poses);
  ASSERT_THAT(codesIn(findings), ElementsAre("poses_frozen"));
  EXPECT_THAT(findings[0].text, HasSubstr("the positions of the poses stand still"));
  findings = findingsOf(phone(), poses);
  ASSERT_THAT(codesIn(findings), ElementsAre("poses_frozen")) << "without a speed";
  EXPECT_THAT(findings[0].text, HasSubstr("m away"));
  // A tracker that lost the way goes on from its last position.
  poses = sound;
  const Eigen::Vector3d lost = sound[184].T_WB.p - sound[168].T_WB.p;
  for (std::size_t i = 168; i < poses.size(); ++i)
    poses[i].T_WB.p = i < 184 ? sound[168].T_WB.p : Eigen::Vector3d(sound[i].T_WB.p - lost);
  findings = findingsOf(phone(), poses);
  ASSERT_THAT(codesIn(findings), ElementsAre("poses_frozen"));
  EXPECT_THAT(findings[0].text, HasSubstr("without braking"));
}

TEST(PoseCheck, ABodyAtRestMayRepeatItsPose) {
  Way way = curve(0.4);
  way.poses = inUnit(way.poses, 0.02);  // so slow that it may stop at once
  const RigidTransform rest = way.poses[50].T_WB, back = rest * way.poses[99].T_WB.inverse();
  for (std::size_t i = 50; i < way.poses.size(); ++i)
    way.poses[i].T_WB = i < 100 ? rest : back * way.poses[i].T_WB;
  for (int i = 0; i < 4000; ++i) {
    ImuSample sample;
    sample.time = TimePoint(durationFromSeconds(100.0 + 0.005 * i));
    sample.gyro = {0.01, -0.02, 0.015 + (i % 2 == 0 ? 0.01 : -0.01)};
    sample.accel = {0.0, 0.0, 9.81};
    way.recording.imu.push_back(sample);
  }
  EXPECT_THAT(codesIn(findingsOf(way, way.poses)), Not(testing::Contains("poses_frozen")));
  SpeedSample speed;
  speed.time = TimePoint(durationFromSeconds(107.0)), speed.speed = 5.0;
  way.recording.speed.push_back(speed);
  EXPECT_THAT(codesIn(findingsOf(way, way.poses)), ElementsAre("poses_frozen"));
}

TEST(PoseCheck, ASpeedThatNothingHasIsToldWithoutAnImu) {
  Way way = phone();
  way.recording.imu.clear();
  EXPECT_THAT(codesIn(findingsOf(way, way.poses)), ElementsAre());
  EXPECT_THAT(codesIn(findingsOf(way, inUnit(way.poses, 1000.0))), ElementsAre("poses_too_fast"));
}

TEST(PoseCheck, AnOffsetAtTheEndOfTheSearchIsReportedAsALowerLimit) {
  Poses late = phone().poses;
  for (auto& pose : late) pose.time += std::chrono::milliseconds(2050);
  const auto findings = findingsOf(phone(), late);
  ASSERT_THAT(codesIn(findings), ElementsAre("poses_time_offset"));
  EXPECT_THAT(findings[0].text, HasSubstr("turns at least 2.00 s before"));
  EXPECT_THAT(findings[0].text, HasSubstr("of the poses and check again"));
}

TEST(PoseCheck, PosesOnAnotherClockAreFoundByTheAccelerometerIfNothingTurns) {
  const Way straight = wayOf(Eigen::Vector3d::Zero());
  EXPECT_THAT(codesIn(findingsOf(straight, straight.poses)), ElementsAre());
  for (const int late_ms : {400, -700}) {
    Poses poses = straight.poses;
    for (auto& pose : poses) pose.time += std::chrono::milliseconds(late_ms);
    const auto findings = findingsOf(straight, poses);
    ASSERT_THAT(codesIn(findings), ElementsAre("poses_time_offset"));
    EXPECT_THAT(findings[0].text, HasSubstr(late_ms > 0 ? "subtract 0.40 s" : "add 0.70 s"));
  }
}

TEST(PoseCheck, PosesOnAnotherClockAreToldByTheGyroscope) {
  Poses late = phone().poses;
  for (auto& pose : late) pose.time += std::chrono::milliseconds(400);
  const auto findings = findingsOf(phone(), late);
  ASSERT_THAT(codesIn(findings), ElementsAre("poses_time_offset"));
  EXPECT_THAT(findings[0].text, HasSubstr("subtract 0.40 s from"));
}

TEST(PoseCheck, AClockOfAnotherRateIsTold) {
  Poses fast = phone().poses;
  for (auto& pose : fast) {
    pose.time = fast.front().time +
                durationFromSeconds(1.02 * toSeconds(pose.time - phone().poses.front().time));
  }
  const auto findings = findingsOf(phone(), fast);
  ASSERT_THAT(codesIn(findings), ElementsAre("poses_clock_rate"));
  EXPECT_THAT(findings[0].text, AllOf(HasSubstr("about 2."), HasSubstr("% too fast")));
}

TEST(PoseCheck, PosesOfAnotherDriveAreTold) {
  EXPECT_THAT(codesIn(findingsOf(wayOf({1.4, 0.0, 0.0}), wayOf({0.0, 1.4, 0.3}).poses)),
              ElementsAre("poses_contradict_gyro"));
}

TEST(PoseCheck, AnImuInOtherUnitsIsNotTakenForTruth) {
  Way way = phone();
  for (auto& sample : way.recording.imu) sample.gyro *= 57.3, sample.accel *= 1000.0;
  EXPECT_THAT(codesIn(findingsOf(way, way.poses)), ElementsAre());
}

TEST(PoseCheck, KittiPosesHaveTheTimesOfTheirFrames) {
  replay::Recording recording;
  for (const std::uint64_t index : {2U, 4U, 9U}) {
    recording.frames.push_back(
        {TimePoint(std::chrono::milliseconds(100 * index)), index, 0, {}, {}});
  }
  Poses poses(6);
  for (std::size_t i = 0; i < poses.size(); ++i) poses[i].T_WB.p.x() = static_cast<double>(i);
  const Poses timed = timedPoses({replay::PoseFormat::kKitti, poses}, recording);
  ASSERT_EQ(timed.size(), 2U);
  EXPECT_EQ(timed[1].time, TimePoint(std::chrono::milliseconds(400)));
  EXPECT_EQ(timed[1].T_WB.p.x(), 4.0);
}

}  // namespace
}  // namespace perdure::tools
