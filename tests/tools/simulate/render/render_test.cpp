// Compares rendered images with geometry.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "common/math/so3.h"
#include "tests/tools/simulate/render/small_world.h"
#include "tools/simulate/render/outline.h"
#include "tools/simulate/render/renderer.h"
#include "tools/simulate/render/sensor.h"

namespace perdure::tools {
namespace {

struct Drawn {
  explicit Drawn(const sim::Scene& scene, int threads = 2, double time_s = 0.0)
      : workers(threads),
        world(scene),
        renderer(world, workers),
        lens(scene.rig.true_calibration.cameras[0]),
        shot(shotAt(scene, 0, time_s)) {
    renderer.render(lens, shot, picture);
  }
  std::vector<sim::TruthView> views() { return viewsOf(world, lens, shot, picture, 1, workers); }
  Box boxOf(std::uint32_t instance) const {
    Box box{1e9, 1e9, -1e9, -1e9};
    for (int row = 0; row < picture.height; ++row) {
      for (int column = 0; column < picture.width; ++column) {
        if (picture.instance[picture.index(column, row)] != instance) continue;
        box = {std::min<double>(box.x1, column), std::min<double>(box.y1, row),
               std::max<double>(box.x2, column), std::max<double>(box.y2, row)};
      }
    }
    return box;
  }

  Workers workers;
  World world;
  Renderer renderer;
  Lens lens;
  Shot shot;
  Picture picture;
};

TEST(Renderer, DrawsAThingWhereTheCameraModelProjectsItsCorners) {
  sim::Scene scene = emptyWorld(320, 240);
  scene.objects = {thing(1, "couch", {0.9, 2.0, 0.9}, {4.0, 0.5, 1.0})};
  Drawn drawn(scene);
  Box wanted{1e9, 1e9, -1e9, -1e9};
  const RigidTransform T_CW = (drawn.shot.body.T_WB * drawn.shot.T_BC).inverse();
  const Instance& instance = drawn.world.instances()[1];
  for (const auto& p : instance.surface->positions) {
    const auto pixel =
        drawn.lens.model().project(T_CW * Eigen::Vector3d((p + instance.p).cast<double>()));
    ASSERT_TRUE(pixel);
    wanted = {std::min(wanted.x1, pixel->x()), std::min(wanted.y1, pixel->y()),
              std::max(wanted.x2, pixel->x()), std::max(wanted.y2, pixel->y())};
  }
  const Box box = drawn.boxOf(1);
  EXPECT_NEAR(box.x1, wanted.x1, 1.1);
  EXPECT_NEAR(box.y1, wanted.y1, 1.1);
  EXPECT_NEAR(box.x2, wanted.x2, 1.1);
  EXPECT_NEAR(box.y2, wanted.y2, 1.1);
  const auto views = drawn.views();
  ASSERT_EQ(views.size(), 1U);
  EXPECT_GT(views[0].visible_fraction, 0.97);
  EXPECT_NEAR(views[0].box.x1, wanted.x1, 1e-3);
  EXPECT_NEAR(views[0].box.y2, wanted.y2, 1e-3);
}

TEST(Outline, SaysHowMuchOfAThingAWallLeavesToBeSeen) {
  sim::Scene scene = emptyWorld(320, 240);
  scene.objects = {thing(5, "couch", {0.9, 2.0, 0.9}, {6.0, 0.0, 1.2})};
  // The edge of the wall is in the plane y = 0, which contains the camera and the couch's centre.
  scene.props = {wall({0.02, 4.0, 4.0}, {3.0, -2.0, 1.2})};
  Drawn drawn(scene);
  ASSERT_EQ(drawn.views().size(), 1U);
  EXPECT_EQ(drawn.views()[0].object_id, 5U);
  EXPECT_NEAR(drawn.views()[0].visible_fraction, 0.5, 0.04);
}

TEST(Outline, KeepsARowForWhatIsWhollyHiddenAndNoneForWhatIsElsewhere) {
  sim::Scene scene = emptyWorld();
  scene.objects = {thing(1, "couch", {0.9, 2.0, 0.9}, {6.0, 0.0, 1.2}),
                   thing(2, "couch", {0.9, 2.0, 0.9}, {-6.0, 0.0, 1.2}),
                   thing(3, "couch", {0.9, 2.0, 0.9}, {3.0, 12.0, 1.2}),
                   thing(4, "couch", {0.9, 2.0, 0.9}, {2.5, -2.5, 1.2})};
  scene.objects[3].present_until_s = -1.0;
  scene.props = {wall({0.02, 4.0, 4.0}, {3.0, 0.0, 1.2})};
  Drawn drawn(scene);
  ASSERT_EQ(drawn.views().size(), 1U);
  EXPECT_EQ(drawn.views()[0].object_id, 1U);
  EXPECT_EQ(drawn.views()[0].visible_fraction, 0.0);
}

TEST(Outline, AHedgeHidesACarFromOneSideAndNotFromTheOther) {
  for (const sim::PropKind kind : {sim::PropKind::kHedge, sim::PropKind::kWall}) {
    sim::Scene scene = emptyWorld();
    scene.objects = {thing(1, "car", {4.2, 1.7, 1.4}, {10.0, 0.0, 0.7})};
    scene.props = {wall({0.6, 8.0, 1.8}, {5.0, 0.0, 0.9})};
    scene.props[0].kind = kind;
    Drawn before(scene);
    ASSERT_EQ(before.views().size(), 1U);
    EXPECT_EQ(before.views()[0].visible_fraction, 0.0);
    scene.body = sim::Trajectory(RigidTransform(expQuaternion({0, 0, M_PI}), {20.0, 0.0, 1.2}));
    Drawn behind(scene);
    ASSERT_EQ(behind.views().size(), 1U);
    EXPECT_GT(behind.views()[0].visible_fraction, 0.95);
  }
}

TEST(Outline, CountsThePartBeyondTheImagesBorder) {
  sim::Scene scene = emptyWorld(320, 240);
  // Half of it is beyond the left border, where the ray has x/z = −0.83 before distortion.
  const Lens lens(scene.rig.calibration.cameras[0]);
  const auto edge = lens.model().unproject({-0.5, 120.0});
  scene.objects = {thing(1, "monitor", {0.3, 0.5, 0.4}, {5.0, -5.0 * edge->x(), 1.2})};
  Drawn drawn(scene);
  const auto views = drawn.views();
  ASSERT_EQ(views.size(), 1U);
  EXPECT_LT(views[0].box.x1, -5.0);
  EXPECT_NEAR(views[0].visible_fraction, 0.5, 0.1);
}

TEST(Outline, OfAThingThatTheBorderCutsHasTheBoxOfWhatIsDrawn) {
  sim::Scene scene = emptyWorld(320, 240);
  scene.objects = {thing(1, "couch", {2.0, 0.9, 0.9}, {2.2, 2.0, 1.0})};
  Drawn drawn(scene);
  const auto views = drawn.views();
  ASSERT_EQ(views.size(), 1U);
  ASSERT_TRUE(views[0].inside);
  const Box seen = drawn.boxOf(1), inside = *views[0].inside;
  EXPECT_NEAR(inside.x1, seen.x1, 1.1);
  EXPECT_NEAR(inside.y1, seen.y1, 1.1);
  EXPECT_NEAR(inside.x2, seen.x2, 1.1);
  EXPECT_NEAR(inside.y2, seen.y2, 1.1);
  EXPECT_GT(views[0].box.y2 - inside.y2, 5.0) << "its near end is outside";
  scene.objects = {thing(1, "couch", {0.9, 2.0, 0.9}, {4.0, 0.5, 1.0})};
  EXPECT_FALSE(Drawn(scene).views()[0].inside);
}

TEST(Renderer, IdentifiesAtAReducedResolutionWhatItDraws) {
  sim::Scene scene = emptyWorld();
  scene.objects = {thing(1, "couch", {0.9, 2.0, 0.9}, {4.0, 0.0, 0.45})};
  Drawn drawn(scene);
  Picture coarse;
  drawn.renderer.identify(drawn.lens, drawn.shot, 2, coarse);
  ASSERT_EQ(coarse.width, 80);
  for (int row = 0; row < coarse.height; ++row) {
    for (int column = 0; column < coarse.width; ++column) {
      ASSERT_EQ(coarse.instance[coarse.index(column, row)],
                drawn.picture.instance[drawn.picture.index(2 * column, 2 * row)]);
    }
  }
}

TEST(Renderer, DrawsTheSameWithOneThreadAndWithThree) {
  sim::Scene scene = emptyWorld();
  scene.objects = {thing(1, "couch", {0.9, 2.0, 0.9}, {4.0, 0.0, 0.45}),
                   thing(2, "person", {0.4, 0.6, 1.8}, {5.0, 2.0, 0.9})};
  const Drawn one(scene, 1), three(scene, 3);
  EXPECT_EQ(one.picture.instance, three.picture.instance);
  ASSERT_EQ(one.picture.radiance.size(), three.picture.radiance.size());
  for (std::size_t i = 0; i < one.picture.radiance.size(); ++i) {
    ASSERT_EQ(one.picture.radiance[i], three.picture.radiance[i]) << i;
  }
}

TEST(Renderer, MovesWhatMovesAndDropsWhatIsGone) {
  sim::Scene scene = emptyWorld();
  scene.objects = {thing(1, "couch", {0.9, 2.0, 0.9}, {5.0, 0.0, 1.2})};
  std::vector<RigidTransform> poses;
  for (int i = 0; i < 12; ++i) {
    poses.emplace_back(Eigen::Matrix3d(Eigen::Matrix3d::Identity()),
                       Eigen::Vector3d(5.0, 0.2 * i, 1.2));
  }
  scene.objects[0].motion = sim::Trajectory(0.0, 0.1, poses);
  scene.objects[0].moves = true;
  scene.objects[0].present_until_s = 0.9;
  Drawn drawn(scene);
  const Box before = drawn.boxOf(1);
  drawn.renderer.render(drawn.lens, shotAt(scene, 0, 0.8), drawn.picture);
  const Box after = drawn.boxOf(1);
  EXPECT_LT(after.x1, before.x1 - 10.0);  // y of W points to the left
  drawn.renderer.render(drawn.lens, shotAt(scene, 0, 0.95), drawn.picture);
  EXPECT_EQ(std::count(drawn.picture.instance.begin(), drawn.picture.instance.end(), 1U), 0);
}

/// Width of the vertical edge between a dark wall and the sky, in pixels.
double edgeWidth(const Picture& picture) {
  double sum = 0.0, largest = 0.0;
  const int row = picture.height / 2;
  for (int column = 1; column < picture.width; ++column) {
    const double step = std::abs(picture.radiance[picture.index(column, row)].y() -
                                 picture.radiance[picture.index(column - 1, row)].y());
    sum += step, largest = std::max(largest, step);
  }
  return sum / largest;
}

TEST(Renderer, SmearsWhatMovesDuringTheExposure) {
  sim::Scene scene = emptyWorld();
  scene.rig.cameras[0].exposure_s = 0.05;
  scene.objects = {thing(1, "monitor", {0.1, 3.0, 3.0}, {5.0, 0.0, 1.5})};
  std::vector<RigidTransform> turning;
  for (int i = 0; i < 20; ++i) {
    turning.emplace_back(Eigen::Matrix3d(Eigen::AngleAxisd(0.1 * i, Eigen::Vector3d::UnitZ())),
                         Eigen::Vector3d(0, 0, 1.2));
  }
  Drawn still(scene);
  scene.body = sim::Trajectory(-1.0, 0.1, turning);
  Drawn moving(scene, 2, 0.0);
  EXPECT_GT(edgeWidth(moving.picture), 1.5 * edgeWidth(still.picture));
}

/// Returns the mean column of the first object's pixels in a row, or nothing.
std::optional<double> middleOf(const Picture& picture, int row) {
  double sum = 0.0, count = 0.0;
  for (int column = 0; column < picture.width; ++column) {
    if (picture.instance[picture.index(column, row)] != 1) continue;
    sum += column, ++count;
  }
  return count > 0 ? std::optional(sum / count) : std::nullopt;
}

TEST(Renderer, ExposesRowsInTurnWithARollingShutter) {
  sim::Scene scene = emptyWorld();
  scene.rig.cameras[0].exposure_s = 0.0;
  scene.objects = {thing(1, "couch", {0.5, 1.0, 5.0}, {6.0, 0.0, 1.2})};
  std::vector<RigidTransform> turning;
  for (int i = 0; i < 20; ++i) {
    turning.emplace_back(
        Eigen::Matrix3d(Eigen::AngleAxisd(0.2 * (i - 10), Eigen::Vector3d::UnitZ())),
        Eigen::Vector3d(0, 0, 1.2));
  }
  scene.body = sim::Trajectory(-1.0, 0.1, turning);
  const Drawn at_once(scene);
  scene.rig.true_calibration.cameras[0].readout_s = 0.05;
  const Drawn in_turn(scene);
  int rows = 0;
  for (int row = 0; row < 120; ++row) {
    const auto before = middleOf(at_once.picture, row), after = middleOf(in_turn.picture, row);
    if (!before || !after) continue;
    // A left turn at 2 rad/s moves objects to the right, by 96 px per radian.
    EXPECT_NEAR(*after - *before, 2.0 * 0.05 * 96.0 * (row / 119.0 - 0.5), 1.0) << row;
    ++rows;
  }
  EXPECT_GT(rows, 40);
}

Picture evenPicture(float light) {
  Picture picture;
  picture.width = 160, picture.height = 120;
  picture.radiance.assign(160 * 120, Eigen::Vector4f::Constant(light));
  return picture;
}

double meanOf(const std::vector<std::uint8_t>& image) {
  double sum = 0.0;
  for (const auto value : image) sum += value;
  return sum / static_cast<double>(image.size());
}

TEST(Sensor, AdaptsToLightWithinASecondAndNotAtOnce) {
  Workers workers(1);
  const Lens lens(emptyWorld().rig.calibration.cameras[0]);
  Sensor sensor(SensorOptions{}, lens);
  const double before = meanOf(sensor.develop(evenPicture(0.3F), 0, workers));
  const double at_once = meanOf(sensor.develop(evenPicture(1.2F), 1, workers));
  EXPECT_GT(at_once, before + 30.0);
  double later = 0.0;
  for (std::uint64_t i = 2; i < 40; ++i) {
    later = meanOf(sensor.develop(evenPicture(1.2F), i, workers));
  }
  EXPECT_NEAR(later, before, 6.0);
}

TEST(Sensor, NoiseGrowsWithTheRootOfTheLightAndIsTheSameAgain) {
  Workers workers(2);
  const Lens lens(emptyWorld().rig.calibration.cameras[0]);
  SensorOptions options;
  options.errors.vignetting = 0.0;
  options.errors.gain_walk = 0.0;
  options.encoding = ImageEncoding::kMono8;
  Sensor first(options, lens), second(options, lens);
  const auto image = first.develop(evenPicture(0.3F), 3, workers);
  EXPECT_EQ(image, second.develop(evenPicture(0.3F), 3, workers));
  EXPECT_NE(image, second.develop(evenPicture(0.3F), 4, workers));
  const double mean = meanOf(image);
  double squares = 0.0;
  for (const auto value : image) squares += (value - mean) * (value - mean);
  const double sigma = std::sqrt(squares / static_cast<double>(image.size()));
  // 0.16 of 10 000 electrons: σ = √(1600 + 12²) = 41.8, times the slope of the gamma curve there.
  const double slope = 255.0 / 2.2 * std::pow(0.16, 1.0 / 2.2 - 1.0);
  EXPECT_NEAR(sigma, 41.8e-4 * slope, 0.25);
}

TEST(Sensor, WithoutNoiseAnEvenSceneIsEvenUpToTheFadingCorners) {
  Workers workers(1);
  const Lens lens(emptyWorld().rig.calibration.cameras[0]);
  SensorOptions options;
  options.noise = false;
  Sensor sensor(options, lens);
  const auto image = sensor.develop(evenPicture(0.3F), 0, workers);
  EXPECT_GT(image[(60 * 160 + 80) * 3], image[0]);
  options.errors.vignetting = 0.0;
  Sensor even(options, lens);
  const auto flat = even.develop(evenPicture(0.3F), 0, workers);
  EXPECT_EQ(*std::min_element(flat.begin(), flat.end()),
            *std::max_element(flat.begin(), flat.end()));
}

}  // namespace
}  // namespace perdure::tools
