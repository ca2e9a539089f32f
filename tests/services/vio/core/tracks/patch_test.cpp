#include "services/vio/core/tracks/patch.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <random>
#include <set>

#include "services/vio/core/tracks/tracker.h"
#include "tests/services/vio/simulated_drive.h"

namespace perdure::vio {
namespace {

using test::texture;

/// pixel ← A (pixel − centre) + centre + shift, with brightness and noise.
struct View {
  cv::Matx22d A = cv::Matx22d::eye();
  cv::Vec2d shift{0, 0};
  double gain = 1.0, offset = 0.0, noise = 0.0;

  cv::Point2f operator()(const cv::Point2f& p) const {
    const cv::Vec2d moved = A * cv::Vec2d(p.x - 376, p.y - 240) + cv::Vec2d(376, 240) + shift;
    return {static_cast<float>(moved[0]), static_cast<float>(moved[1])};
  }
  cv::Mat of(const cv::Mat& image, unsigned seed) const {
    const cv::Vec2d t = cv::Vec2d(376, 240) + shift - A * cv::Vec2d(376, 240);
    const cv::Mat M = (cv::Mat_<double>(2, 3) << A(0, 0), A(0, 1), t[0], A(1, 0), A(1, 1), t[1]);
    cv::Mat result, grain(image.size(), CV_8SC1);
    cv::warpAffine(image, result, M, image.size(), cv::INTER_CUBIC, cv::BORDER_REFLECT);
    result.convertTo(result, CV_32F, gain, offset);
    cv::RNG random(seed);
    random.fill(grain, cv::RNG::NORMAL, 0, noise);
    cv::add(result, grain, result, {}, CV_32F);
    result.convertTo(result, CV_8UC1);
    return result;
  }
};

std::vector<cv::Mat> levelsOf(const cv::Mat& image) {
  std::vector<cv::Mat> levels{image};
  for (int i = 0; i < 3; ++i) {
    levels.emplace_back();
    cv::pyrDown(levels[levels.size() - 2], levels.back());
  }
  return levels;
}

std::vector<cv::Point2f> places() {
  std::vector<cv::Point2f> result;
  for (int y = 60; y < 430; y += 31) {
    for (int x = 60; x < 700; x += 37) {
      result.emplace_back(static_cast<float>(x) + 0.3F, static_cast<float>(y) + 0.7F);
    }
  }
  return result;
}

TEST(Patch, IsFoundTurnedGrownLeantAndInOtherLight) {
  const cv::Mat image = texture(4);
  View view;
  view.A = {1.16, -0.11, 0.14, 1.09};
  view.shift = {1.2, -0.8};
  view.gain = 0.7;
  view.offset = 30;
  view.noise = 3;
  const auto levels = levelsOf(view.of(image, 5));
  double squares = 0;
  int found = 0, asked = 0;
  for (const cv::Point2f& p : places()) {
    const cv::Point2f truth = view(p);
    if (truth.x < 20 || truth.y < 20 || truth.x > 731 || truth.y > 459) continue;
    auto patch = Patch::cut(image, p);
    ASSERT_TRUE(patch);
    ++asked;
    const auto now = patch->find(levels, truth + cv::Point2f(0.9F, -0.7F));
    if (!now || now->similarity < 0.9F) continue;
    ++found;
    squares += std::pow(cv::norm(now->pixel - truth), 2);
    EXPECT_NEAR(patch->growth(), std::sqrt(cv::determinant(view.A)), 0.05);
  }
  EXPECT_GT(found, asked * 9 / 10);
  EXPECT_LT(std::sqrt(squares / found), 0.1);
}

TEST(Patch, IsUnlikeWhatCameInFrontOfIt) {
  const cv::Mat image = texture(4);
  const auto levels = levelsOf(texture(5));
  int like = 0, asked = 0;
  for (const cv::Point2f& p : places()) {
    auto patch = Patch::cut(image, p);
    ASSERT_TRUE(patch);
    const auto now = patch->find(levels, p);
    ++asked;
    like += now && now->similarity > 0.75F;
  }
  EXPECT_LT(like, asked / 50);
}

TEST(Patch, IsNotCutFromAPlainPlaceOrBeyondTheImage) {
  EXPECT_FALSE(Patch::cut(cv::Mat(480, 752, CV_8UC1, cv::Scalar(90)), {300, 200}));
  EXPECT_FALSE(Patch::cut(texture(4), {3, 200}));
  EXPECT_FALSE(Patch::cut(texture(4), {300, 478}));
  EXPECT_FALSE(Patch::cut(texture(4), {std::nanf(""), 200}));
}

TEST(Patch, IsNotFoundBeyondTheImage) {
  const cv::Mat image = texture(4);
  auto patch = Patch::cut(image, {300, 200});
  ASSERT_TRUE(patch);
  EXPECT_FALSE(patch->find(levelsOf(image), {2, 200}));
  EXPECT_FALSE(patch->find(levelsOf(image), {300, std::nanf("")}));
  EXPECT_TRUE(patch->find(levelsOf(image), {300, 200}));
}

TEST(Tracker, DoesNotDriftAlongATrack) {
  const cv::Mat image = texture(4);
  Tracker tracker(TrackerOptions{}, {CameraModel(test::testCamera(0))});
  TrackedFrame first, last;
  View view;
  view.noise = 3;
  constexpr unsigned kImages = 60;
  for (unsigned k = 0; k < kImages; ++k) {  // an approaching wall
    const double grown = 1.0 + 0.6 * k / (kImages - 1);
    view.A = {grown, 0, 0, grown};
    last = tracker.track(view.of(image, k), {}, {});
    if (k == 0) first = last;
  }
  double squares = 0;
  int kept = 0;
  for (const TrackedPoint& a : first.points) {
    for (const TrackedPoint& b : last.points) {
      if (a.id != b.id) continue;
      const Eigen::Vector2d &from = a.seen[0]->pixel, &to = b.seen[0]->pixel;
      const cv::Point2f truth = view({static_cast<float>(from.x()), static_cast<float>(from.y())});
      squares += (to - Eigen::Vector2d(truth.x, truth.y)).squaredNorm();
      ++kept;
    }
  }
  EXPECT_GT(kept, 40);  // the points within two fifths of the image remain, out of 150
  EXPECT_LT(std::sqrt(squares / kept), 0.2);
}

TEST(Tracker, APatchThatHasGrownIsANewPoint) {
  const cv::Mat image = texture(4);
  Tracker tracker(TrackerOptions{}, {CameraModel(test::testCamera(0))});
  const auto idsAt = [&](double grown) {
    View view;
    view.A = {grown, 0, 0, grown};
    std::set<std::uint64_t> ids;
    for (const TrackedPoint& p : tracker.track(view.of(image, 0), {}, {}).points) ids.insert(p.id);
    return ids;
  };
  const auto first = idsAt(1.0);
  std::set<std::uint64_t> before, after;
  for (double grown = 1.05; grown < 1.65; grown += 0.05) before = idsAt(grown);
  for (double grown = 1.65; grown < 1.85; grown += 0.05) after = idsAt(grown);
  const auto of_first = [&](const std::set<std::uint64_t>& ids) {
    return std::count_if(ids.begin(), ids.end(), [&](auto id) { return first.contains(id); });
  };
  EXPECT_GT(of_first(before), 20);
  EXPECT_LT(of_first(after), 3);
  EXPECT_GT(after.size(), before.size() / 2);  // points are still tracked
}

}  // namespace
}  // namespace perdure::vio
