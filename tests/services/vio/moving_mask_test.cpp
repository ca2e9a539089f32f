#include "services/vio/moving_mask.h"

#include <gtest/gtest.h>

#include "services/vio/core/tracks/tracker.h"
#include "tests/services/vio/simulated_drive.h"

namespace perdure::vio {
namespace {

using Eigen::Vector3d;

constexpr WorldId kWorld{7, 2};

TimePoint at(double t) { return fromNanoseconds(1'000'000'000) + durationFromSeconds(t); }

/// A cuboid of 4 × 2 × 1.6 m; its length is along x of W.
ObjectBelief thing(const Vector3d& p_W, const Vector3d& velocity, double moving = 0.9) {
  ObjectBelief o;
  o.id = 1;
  o.existence = 0.9;
  o.moving = moving;
  o.velocity = velocity;
  ClassBelief car{"car", 1.0, Vector7d::Zero(), Matrix7d::Identity(), {}};
  car.mean << p_W, 0.0, std::log(4.0), std::log(2.0), std::log(1.6);
  o.classes = {car};
  return o;
}

Objects at(double t, std::vector<ObjectBelief> objects) {
  Objects all;
  all.stamp.time = at(t);
  all.world = kWorld;
  all.objects = std::move(objects);
  return all;
}

class MovingMaskTest : public testing::Test {
 protected:
  std::vector<cv::Rect2f> boxes(const Objects& objects, double now, const WorldId& world = kWorld,
                                bool enabled = true) const {
    MovingMask mask({.enabled = enabled});
    mask.onObjects(objects);
    return mask.boxes(camera, world, RigidTransform(), at(now));
  }
  CameraModel camera{test::testCamera(0)};
};

TEST_F(MovingMaskTest, CoversEveryPointOfWhatMovesWhereItIsNow) {
  const Vector3d velocity(5, 1, 0), p_W(10, -1, 0);
  const auto result = boxes(at(1.0, {thing(p_W, velocity)}), 1.2);
  ASSERT_EQ(result.size(), 1U);
  for (int i = 0; i < 27; ++i) {
    const Vector3d offset((i % 3 - 1) * 2.0, (i / 3 % 3 - 1) * 1.0, (i / 9 - 1) * 0.8);
    const auto pixel = camera.project(camera.T_BC().inverse() * (p_W + 0.2 * velocity + offset));
    ASSERT_TRUE(pixel);
    EXPECT_TRUE(
        result[0].contains({static_cast<float>(pixel->x()), static_cast<float>(pixel->y())}));
  }
  EXPECT_LT(result[0].area(), 0.1F * 752 * 480);
}

TEST_F(MovingMaskTest, LeavesOutWhatStandsIsOldOrOfAnotherWorld) {
  const auto one = at(1.0, {thing({10, 0, 0}, {5, 0, 0})});
  EXPECT_EQ(boxes(one, 1.0).size(), 1U);
  EXPECT_TRUE(boxes(at(1.0, {thing({10, 0, 0}, {0, 0, 0}, 0.2)}), 1.0).empty());
  EXPECT_TRUE(boxes(one, 2.5).empty());
  EXPECT_TRUE(boxes(one, 0.9).empty());
  EXPECT_TRUE(boxes(one, 1.0, {7, 3}).empty());
  EXPECT_TRUE(boxes(one, 1.0, kWorld, false).empty());
  EXPECT_TRUE(boxes(at(1.0, {thing({-10, 0, 0}, {5, 0, 0})}), 1.0).empty());
}

TEST_F(MovingMaskTest, ReachesTheBorderWhereItPassesTheCamera) {
  const auto result = boxes(at(1.0, {thing({0.5, 2.0, 0}, {5, 0, 0})}), 1.0);
  ASSERT_EQ(result.size(), 1U);
  EXPECT_LE(result[0].x, 0.0F);  // on the left
  EXPECT_GT(result[0].height, 300.0F);
  EXPECT_LT(result[0].x + result[0].width, 376.0F);
}

TEST(Tracker, PutsNoPointsIntoMaskedBoxes) {
  const cv::Mat image = test::texture(4);
  Tracker tracker(TrackerOptions{}, {CameraModel(test::testCamera(0))});
  const cv::Rect2f box(200, 100, 200, 200);
  const auto inside = [&](const TrackedFrame& frame) {
    return std::count_if(frame.points.begin(), frame.points.end(), [&](const TrackedPoint& p) {
      const Eigen::Vector2f pixel = p.seen[0]->pixel.cast<float>();
      return box.contains({pixel.x(), pixel.y()});
    });
  };
  EXPECT_GT(inside(tracker.track(image, {}, {})), 5);
  EXPECT_EQ(inside(tracker.track(image, {}, {}, {box})), 0);
  EXPECT_EQ(inside(tracker.track(image, {}, {}, {box})), 0);
}

}  // namespace
}  // namespace perdure::vio
