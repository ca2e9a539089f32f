#include "services/vio/core/tracks/tracker.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <random>

#include "common/math/hamming_distance.h"
#include "common/math/so3.h"
#include "services/vio/core/tracks/descriptor.h"
#include "tests/services/vio/simulated_drive.h"

namespace perdure::vio {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

std::vector<Match> matchesUnder(const Matrix3d& R, const Vector3d& t, int good, int bad) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  std::vector<Match> matches;
  for (int i = 0; i < good + bad; ++i) {
    const Vector3d p(3.0 * u(random), 2.0 * u(random), 5.0 + 2.0 * u(random));
    Vector2d now = (R * p + t).hnormalized();
    if (i >= good) now += Vector2d(0.1 * u(random) + 0.05, 0.1 * u(random) - 0.08);
    matches.push_back({p.hnormalized(), now, 450.0});
  }
  return matches;
}

TEST(TwoPointRansac, KeepsWhatMovesWithTheCameraAndDropsTheRest) {
  const Matrix3d R = expSo3(Vector3d(0.02, -0.05, 0.01));
  const auto matches = matchesUnder(R, Vector3d(0.3, -0.1, 0.2), 80, 30);
  const auto good = twoPointRansac(matches, R, 1.0);
  int wrong = 0;
  for (std::size_t i = 0; i < 80; ++i) EXPECT_TRUE(good[i]) << i;
  for (std::size_t i = 80; i < 110; ++i) wrong += good[i];
  EXPECT_LE(wrong, 4);  // some are on their epipolar line by chance
}

TEST(TwoPointRansac, KeepsAllUnderPureRotation) {
  const Matrix3d R = expSo3(Vector3d(0.02, -0.05, 0.01));
  const auto good = twoPointRansac(matchesUnder(R, Vector3d::Zero(), 50, 0), R, 1.0);
  EXPECT_EQ(std::count(good.begin(), good.end(), true), 50);
}

TEST(TwoPointRansac, RefusesNothingWithoutEnoughMatches) {
  const auto good = twoPointRansac(matchesUnder(Matrix3d::Identity(), Vector3d::UnitX(), 3, 0),
                                   Matrix3d::Identity(), 1.0);
  EXPECT_EQ(std::count(good.begin(), good.end(), true), 3);
}

using test::shifted;

cv::Mat texture() { return test::texture(4); }

TEST(Tracker, FollowsAShiftedImageToATenthOfAPixel) {
  Tracker tracker(TrackerOptions{}, {CameraModel(test::testCamera(0))});
  const cv::Mat image = texture();
  const TrackedFrame before = tracker.track(image, {}, {});
  EXPECT_GT(before.points.size(), 100u);
  const TrackedFrame after = tracker.track(shifted(image, 3.3, -2.1), {}, {});
  int followed = 0;
  for (const TrackedPoint& b : before.points) {
    for (const TrackedPoint& a : after.points) {
      if (a.id != b.id) continue;
      const Vector2d moved = a.seen[0]->pixel - b.seen[0]->pixel;
      EXPECT_LT((moved - Vector2d(3.3, -2.1)).norm(), 0.1);
      ++followed;
    }
  }
  EXPECT_GT(followed, 80);
  ASSERT_TRUE(tracker.motionSince(1));
  EXPECT_NEAR(*tracker.motionSince(1), std::hypot(3.3, 2.1), 0.05);
  EXPECT_FALSE(tracker.motionSince(2));
}

// On a street only the points at the horizon are followed for long, and they do not move.
TEST(Tracker, LostPointsCountAsMoved) {
  Tracker tracker(TrackerOptions{}, {CameraModel(test::testCamera(0))});
  const cv::Mat image = texture();
  cv::Mat next = test::texture(5);
  const cv::Rect horizon(0, 140, image.cols, 120);
  image(horizon).copyTo(next(horizon));
  const std::size_t all = tracker.track(image, {}, {}).points.size();
  tracker.track(next, {}, {});
  ASSERT_GT(all, 100u);
  EXPECT_LT(tracker.motionSince(1, 0.05).value(), 0.1);
  EXPECT_TRUE(std::isinf(*tracker.motionSince(1)));
}

/// Returns the image of a camera with rotation R_C(row) at the time of each row, −½ … ½.
template <class Turn>
cv::Mat turnedRowByRow(const cv::Mat& image, const CameraModel& camera, const Turn& R_C) {
  cv::Mat map_x(image.size(), CV_32FC1), map_y(image.size(), CV_32FC1), turned;
  for (int y = 0; y < image.rows; ++y) {
    const Matrix3d R = R_C(y / (image.rows - 1.0) - 0.5).transpose();
    for (int x = 0; x < image.cols; ++x) {
      const auto n = camera.unproject({x, y});
      const auto from = n ? camera.project(R * n->homogeneous()) : std::nullopt;
      map_x.at<float>(y, x) = from ? static_cast<float>(from->x()) : -1.0f;
      map_y.at<float>(y, x) = from ? static_cast<float>(from->y()) : -1.0f;
    }
  }
  cv::remap(image, turned, map_x, map_y, cv::INTER_LINEAR);
  return turned;
}

TEST(Tracker, TheRotationSeedsALargeMotion) {
  const CameraModel camera(test::testCamera(0));
  const Matrix3d R_C = expSo3(Vector3d(0, 0.15, 0));  // about 70 px
  const cv::Mat image = texture();
  const cv::Mat turned = turnedRowByRow(image, camera, [&](double) { return R_C; });
  Tracker tracker(TrackerOptions{}, {camera});
  const TrackedFrame before = tracker.track(image, {}, {});
  const Matrix3d R_BC = camera.T_BC().R();
  const TrackedFrame after = tracker.track(turned, {}, Matrix3d(R_BC * R_C * R_BC.transpose()));
  int right = 0;
  for (const TrackedPoint& b : before.points) {
    const auto expected = camera.project(R_C * b.seen[0]->normalised.homogeneous());
    for (const TrackedPoint& a : after.points) {
      right += a.id == b.id && expected && (a.seen[0]->pixel - *expected).norm() < 0.5;
    }
  }
  EXPECT_GT(right, 60);
}

TEST(Tracker, ARollingShutterThatTurnsContradictsNoRotation) {
  const CameraModel camera(test::testCamera(0));
  const Vector3d turn_C(0.01, 0.0, 0.06);  // during the read-out
  const cv::Mat image = texture();
  const cv::Mat turned =
      turnedRowByRow(image, camera, [&](double row) { return expSo3(-row * turn_C); });
  const auto kept = [&](const Vector3d& turn_B) {
    Tracker tracker(TrackerOptions{}, {camera});
    const TrackedFrame before = tracker.track(image, {}, {});
    const TrackedFrame after =
        tracker.track(turned, {}, Matrix3d(Matrix3d::Identity()), {}, turn_B);
    const auto last = before.points.back().id;
    return std::count_if(after.points.begin(), after.points.end(),
                         [&](const TrackedPoint& p) { return p.id <= last; });
  };
  const auto with = kept(camera.T_BC().R() * turn_C), without = kept(Vector3d::Zero());
  std::printf("kept: %ld, where the turn is not known %ld\n", with, without);
  EXPECT_GT(with, 90);
  EXPECT_LT(without, 0.7 * with);
}

TEST(Tracker, FindsTheSecondCamerasPointsOnTheirEpipolarLines) {
  CameraCalibration second = test::testCamera(1);
  second.distortion = DistortionModel::kNone;
  second.distortion_coefficients.clear();
  CameraCalibration first = test::testCamera(0);
  first.distortion = DistortionModel::kNone;
  first.distortion_coefficients.clear();
  Tracker tracker(TrackerOptions{}, {CameraModel(first), CameraModel(second)});
  const cv::Mat image = texture();
  // A wall at the depth at which the baseline of 11 cm gives 12.5 px.
  const TrackedFrame seen = tracker.track(image, shifted(image, -12.5, 0), {});
  int paired = 0;
  for (const TrackedPoint& p : seen.points) {
    if (!p.seen[1]) continue;
    EXPECT_NEAR(p.seen[0]->pixel.x() - p.seen[1]->pixel.x(), 12.5, 0.3);
    ++paired;
  }
  EXPECT_GT(paired, 80);
}

TEST(Tracker, ASecondCameraOfHalfTheSizeIsFollowed) {
  CameraCalibration first = test::testCamera(0), second = test::testCamera(1);
  for (CameraCalibration* camera : {&first, &second}) {
    camera->distortion = DistortionModel::kNone;
    camera->distortion_coefficients.clear();
  }
  second.width /= 2, second.height /= 2, second.fx /= 2, second.fy /= 2;
  second.cx = 0.5 * (second.cx + 0.5) - 0.5, second.cy = 0.5 * (second.cy + 0.5) - 0.5;
  Tracker tracker(TrackerOptions{}, {CameraModel(first), CameraModel(second)});
  const cv::Mat image = texture();
  cv::Mat half;
  cv::resize(shifted(image, -12.5, 0), half, {}, 0.5, 0.5, cv::INTER_AREA);
  int paired = 0;
  for (const TrackedPoint& p : tracker.track(image, half, {}).points) {
    if (!p.seen[1]) continue;
    EXPECT_NEAR(p.seen[0]->pixel.x() - 2.0 * p.seen[1]->pixel.x() - 0.5, 12.5, 0.4);
    ++paired;
  }
  EXPECT_GT(paired, 60);
}

TEST(Tracker, IdsAreNotGivenAgainAfterAReset) {
  Tracker tracker(TrackerOptions{}, {CameraModel(test::testCamera(0))});
  const TrackedFrame before = tracker.track(texture(), {}, {});
  tracker.reset();
  const TrackedFrame after = tracker.track(texture(), {}, {});
  EXPECT_GT(after.points.front().id, before.points.back().id);
}

TEST(Descriptor, IsTheSameWhereThePatchIsAndAnotherElsewhere) {
  const cv::Mat image = texture();
  const auto here = descriptorAt(image, {200, 150}), elsewhere = descriptorAt(image, {400, 300});
  const auto there = descriptorAt(shifted(image, 5, 7), {205, 157});
  ASSERT_TRUE(here && there && elsewhere);
  EXPECT_LT(hammingDistance(*here, *there), 10);
  EXPECT_GT(hammingDistance(*here, *elsewhere), 80);
  EXPECT_FALSE(descriptorAt(image, {5, 5}));
}

TEST(Descriptor, ComparesWhatOpenCvsBoxFilterWouldGive) {
  const cv::Mat image = texture();
  cv::Mat smooth;
  cv::blur(image, smooth, {5, 5});
  // Draws the pattern by its definition.
  std::uint64_t seed = 20111129;
  const auto draw = [&seed] {
    int sum = 0;
    for (int i = 0; i < 4; ++i) {
      seed = seed * 6364136223846793005ull + 1442695040888963407ull;
      sum += static_cast<int>((seed >> 40) % 9);
    }
    return std::clamp(sum - 16, -13, 13);
  };
  std::vector<std::array<int, 4>> pattern;
  while (pattern.size() < 256) {
    const int x0 = draw(), y0 = draw(), x1 = draw(), y1 = draw();
    if (x0 != x1 || y0 != y1) pattern.push_back({x0, y0, x1, y1});
  }
  for (const auto& [x, y] : {std::pair{200, 150}, {15, 15}, {736, 464}, {401, 77}}) {
    const auto d = descriptorAt(image, Vector2d(x, y));
    ASSERT_TRUE(d) << x << ' ' << y;
    for (std::size_t i = 0; i < pattern.size(); ++i) {
      const auto [x0, y0, x1, y1] = pattern[i];
      const bool bit =
          smooth.at<std::uint8_t>(y + y0, x + x0) < smooth.at<std::uint8_t>(y + y1, x + x1);
      EXPECT_EQ((*d)[i / 8] >> (i % 8) & 1, static_cast<int>(bit)) << i;
    }
  }
}

}  // namespace
}  // namespace perdure::vio
