// Tests the mapping of points with poses from another program: positions, covariances, and rejected
// points.
#include "services/vio/core/known_poses/point_mapper.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <random>

#include "common/math/so3.h"
#include "tests/services/vio/simulated_drive.h"

namespace perdure::vio {
namespace {

using Eigen::Vector3d;

constexpr double kStep = 0.1;  // s between images

test::DriveOptions seeded(unsigned seed) {
  test::DriveOptions options;
  options.seed = seed;
  return options;
}

struct Errors {
  double rotation = 0.0, position = 0.0;  ///< errors of each pose, independent, rad and m
};

/// A drive with given poses, which are used in turn.
class GivenDrive {
 public:
  explicit GivenDrive(const test::DriveOptions& options, Errors errors = {})
      : drive_(options),
        readout_s_(drive_.cameras().size(), options.readout_s),
        errors_(errors),
        random_(options.seed + 7) {}

  PointMapper mapper(bool knows_of_readout = true) const {
    return {VisionOptions{}, WindowOptions{}, drive_.T_BC(),
            knows_of_readout ? readout_s_ : std::vector<double>{}};
  }
  KnownPose poseAt(double t) {
    const Nav nav = drive_.truth(t);
    KnownPose pose;
    pose.T_WB = nav.T_WB();
    pose.T_WB.q = pose.T_WB.q * expQuaternion(draw(errors_.rotation));
    pose.T_WB.p += draw(errors_.position);
    pose.velocity_W = nav.v_WB;
    pose.rate_B = drive_.rateTruth(t);
    return pose;
  }
  void play(PointMapper& mapper, double from, double until) {
    for (double t = from; t < until; t += kStep) mapper.add(poseAt(t), drive_.see(t));
  }
  /// Returns the drive's point with the image at `t` nearest to the landmark's pixel.
  Vector3d truthOf(const Landmark& landmark, double t) const {
    std::size_t best = 0;
    double least = 1e9;
    for (std::size_t i = 0; i < drive_.points().size(); ++i) {
      const auto pixel = drive_.project(0, drive_.points()[i], t);
      if (!pixel || (*pixel - landmark.pixel).norm() >= least) continue;
      least = (*pixel - landmark.pixel).norm();
      best = i;
    }
    return drive_.points()[best];
  }
  test::SimulatedDrive& drive() { return drive_; }

 private:
  Vector3d draw(double sigma) {
    return sigma * Vector3d(normal_(random_), normal_(random_), normal_(random_));
  }

  test::SimulatedDrive drive_;
  std::vector<double> readout_s_;
  Errors errors_;
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
};

struct Honesty {
  std::vector<double> relative, nees;  ///< error relative to distance; NEES with three degrees of
                                       ///< freedom
  double medianRelative() { return median(relative); }
  double medianNees() { return median(nees); }
  static double median(std::vector<double>& v) {
    if (v.empty()) return -1.0;
    const auto middle = v.begin() + static_cast<long>(v.size() / 2);
    std::nth_element(v.begin(), middle, v.end());
    return *middle;
  }
};

Honesty honestyOf(GivenDrive& given, PointMapper& mapper, double from, double until) {
  Honesty honesty;
  for (double t = from; t < until; t += kStep) {
    mapper.add(given.poseAt(t), given.drive().see(t));
    for (const Landmark& l : mapper.landmarks()) {
      const Vector3d error = l.p_W - given.truthOf(l, t);
      const double distance = (l.p_W - given.drive().truth(t).p_WB).norm();
      honesty.relative.push_back(error.norm() / distance);
      honesty.nees.push_back(error.dot(l.covariance.ldlt().solve(error)));
    }
  }
  return honesty;
}

constexpr double kMedianOfChi2 = 2.366;  // with three degrees of freedom

TEST(PointMapper, PointsAreWhereTheyAreAndAsSureAsTheySay) {
  GivenDrive given(seeded(3));
  PointMapper mapper = given.mapper();
  given.play(mapper, 0.0, 1.0);
  Honesty honesty = honestyOf(given, mapper, 1.0, 6.0);
  ASSERT_GT(honesty.nees.size(), 1000u);
  EXPECT_LT(honesty.medianRelative(), 0.02);
  EXPECT_NEAR(honesty.medianNees(), kMedianOfChi2, 0.6);
  EXPECT_LT(mapper.noisePx(), 1.15 * VisionOptions{}.sigma_px);
}

TEST(PointMapper, PosesThatErrWidenWhatIsSaid) {
  GivenDrive given(seeded(4), {.rotation = 0.004, .position = 0.01});
  PointMapper mapper = given.mapper();
  given.play(mapper, 0.0, 3.0);
  // 4 mrad correspond to 1.8 pixels of this camera.
  EXPECT_GT(mapper.noisePx(), 1.0);
  EXPECT_LT(mapper.noisePx(), 3.5);
  Honesty honesty = honestyOf(given, mapper, 3.0, 8.0);
  EXPECT_LT(honesty.medianNees(), 2.0 * kMedianOfChi2);
}

TEST(PointMapper, TheSecondCameraKnowsADistanceAtOnce) {
  test::DriveOptions options = seeded(5);
  options.stereo = true;
  options.rest_s = 100.0;
  GivenDrive given(options);
  PointMapper mapper = given.mapper();
  Honesty honesty = honestyOf(given, mapper, 0.0, 0.5);
  ASSERT_GT(honesty.nees.size(), 20u);
  EXPECT_LT(honesty.medianNees(), 2.0 * kMedianOfChi2);
}

TEST(PointMapper, ABodyAtRestKeepsTheBaselineItHad) {
  GivenDrive given(seeded(6));
  PointMapper mapper = given.mapper();
  given.play(mapper, 0.0, 3.0);
  const std::size_t before = mapper.landmarks().size();
  ASSERT_GT(before, 30u);
  for (int i = 0; i < 100; ++i) mapper.add(given.poseAt(2.95), given.drive().see(2.95));
  EXPECT_GE(10 * mapper.landmarks().size(), 9 * before);
}

TEST(PointMapper, ALongTrackDoesNotTakeTheViewsOfYoungOnes) {
  test::DriveOptions options = seeded(11);
  options.place = test::DrivePlace::kStreet;
  GivenDrive given(options);
  PointMapper mapper = given.mapper();
  // A point far ahead, visible all the time.
  constexpr std::uint64_t kFar = 1'000'000'000, kLife = 6;
  const Vector3d far(2000.0, 30.0, 10.0);
  const CameraModel& camera = given.drive().cameras()[0];
  std::size_t sum = 0;
  std::uint64_t frame = 0;
  for (double t = 0.0; t < 12.0; t += kStep, ++frame) {
    TrackedFrame tracked = given.drive().see(t);
    // All other tracks end after six images, and their points start new tracks.
    for (TrackedPoint& p : tracked.points) p.id = 1000 * p.id + (frame + p.id) / kLife;
    TrackedPoint long_track{kFar, {}};
    long_track.seen[0] = imagePoint(camera, given.drive().project(0, far, t).value());
    tracked.points.push_back(long_track);
    mapper.add(given.poseAt(t), tracked);
    sum += mapper.landmarks().size();
  }
  EXPECT_GT(sum / frame, 8u) << "on average";
}

TEST(PointMapper, WhatMovesIsLeftOut) {
  GivenDrive given(seeded(7));
  PointMapper mapper = given.mapper();
  constexpr std::uint64_t kMoving = 1'000'000;
  const CameraModel& camera = given.drive().cameras()[0];
  bool seen = false;
  for (double t = 0.0; t < 3.0; t += kStep) {
    TrackedFrame tracked = given.drive().see(t);
    // The point moves across the image, independently of the body.
    TrackedPoint moving{kMoving, {}};
    moving.seen[0] = imagePoint(camera, {300.0 + 20.0 * t, 240.0 + 25.0 * std::sin(3.0 * t)});
    ASSERT_TRUE(moving.seen[0]);
    tracked.points.push_back(moving);
    mapper.add(given.poseAt(t), tracked);
    if (t < 1.0) continue;
    for (const Landmark& l : mapper.landmarks()) seen = seen || l.id == kMoving;
  }
  EXPECT_FALSE(seen);
  EXPECT_GT(mapper.landmarks().size(), 30u);
}

TEST(PointMapper, EachRowIsSeenFromWhereItWas) {
  test::DriveOptions options = seeded(8);
  options.readout_s = 0.03;
  GivenDrive given(options);
  PointMapper knows = given.mapper(), ignores = given.mapper(false);
  given.play(knows, 0.0, 1.0);
  Honesty with = honestyOf(given, knows, 1.0, 5.0);
  given.play(ignores, 0.0, 1.0);
  Honesty without = honestyOf(given, ignores, 1.0, 5.0);
  EXPECT_NEAR(with.medianNees(), kMedianOfChi2, 0.8);
  EXPECT_GT(without.medianNees(), 3.0 * kMedianOfChi2);
}

TEST(PointMapper, AnotherFrameOfReferenceBeginsWithNothing) {
  GivenDrive given(seeded(9));
  PointMapper mapper = given.mapper();
  given.play(mapper, 0.0, 2.0);
  ASSERT_FALSE(mapper.landmarks().empty());
  mapper.clear();
  EXPECT_TRUE(mapper.landmarks().empty());
  mapper.add(given.poseAt(2.0), given.drive().see(2.0));
  EXPECT_TRUE(mapper.landmarks().empty());
}

TEST(PointMapper, AWhileOfBadPosesIsForgotten) {
  test::DriveOptions options = seeded(12);
  options.place = test::DrivePlace::kStreet;
  GivenDrive good(options), bad(options, {.rotation = 0.13, .position = 0.4});
  PointMapper mapper = good.mapper();
  // Short tracks and closely spaced images, as of a slow robot, give few pixels of parallax.
  constexpr std::uint64_t kLife = 6;
  std::uint64_t frame = 0;
  const auto play = [&](GivenDrive& poses, double from, double until) {
    for (double t = from; t < until; t += 0.03, ++frame) {
      TrackedFrame tracked = good.drive().see(t);
      for (TrackedPoint& p : tracked.points) p.id = 1000 * p.id + (frame + p.id) / kLife;
      mapper.add(poses.poseAt(t), tracked);
    }
  };
  const auto pointsOf = [&](double from, double until) {
    std::size_t sum = 0;
    const std::uint64_t before = frame;
    for (double t = from; t < until; t += 0.03) {
      play(good, t, t + 0.02);
      sum += mapper.landmarks().size();
    }
    return static_cast<double>(sum) / static_cast<double>(frame - before);
  };
  play(good, 0.0, 2.0);
  const double before = pointsOf(2.0, 3.0);
  ASSERT_GT(before, 2.0);
  play(bad, 3.0, 7.0);
  ASSERT_GT(mapper.noisePx(), 10.0 * VisionOptions{}.sigma_px);
  play(good, 7.0, 19.0);
  EXPECT_LT(mapper.noisePx(), 2.0 * VisionOptions{}.sigma_px);
  EXPECT_GT(pointsOf(19.0, 20.0), 0.7 * before);
}

TEST(PointMapper, TheErrorOfThePoseIsThatOfThePoint) {
  GivenDrive given(seeded(10));
  PointMapper mapper = given.mapper();
  given.play(mapper, 0.0, 2.0);
  KnownPose pose = given.poseAt(2.0);
  pose.covariance = 1e-4 * Matrix6d::Identity();
  mapper.add(pose, given.drive().see(2.0));
  ASSERT_FALSE(mapper.landmarks().empty());
  const Landmark& l = mapper.landmarks().front();
  Eigen::Matrix<double, 6, 1> error;
  error << 0.002, -0.001, 0.003, 0.01, 0.02, -0.03;
  RigidTransform moved = pose.T_WB;
  moved.q = moved.q * expQuaternion(error.head<3>());
  moved.p += error.tail<3>();
  const Vector3d shift = moved * (pose.T_WB.inverse() * l.p_W) - l.p_W;
  EXPECT_LT((l.cross_pose * error / 1e-4 - shift).norm(), 0.01 * shift.norm());
}

}  // namespace
}  // namespace perdure::vio
