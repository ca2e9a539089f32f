#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "common/base/errors.h"
#include "common/camera/camera_model.h"
#include "common/math/so3.h"
#include "common/sim/catalogue.h"
#include "common/sim/scene.h"
#include "common/sim/solid.h"

namespace perdure::sim {
namespace {

using testing::Contains;
using testing::HasSubstr;

std::vector<std::string> allNames() {
  std::vector<std::string> names;
  for (const SceneName& name : sceneNames()) names.push_back(name.name);
  return names;
}

std::vector<std::uint64_t> seedsOf(const std::string& name) {
  if (name == "town" || name == "suburb" || name == "blocks" || name == "kilometre") return {7};
  return {1, 2, 3, 7};
}

bool onVehicle(const Scene& scene) { return scene.rig.speed.has_value(); }

/// Returns the times of the checks; one time if nothing moves.
std::vector<double> timesOf(const Scene& scene) {
  const bool moves = std::any_of(scene.objects.begin(), scene.objects.end(),
                                 [](const SceneObject& o) { return o.moves; });
  std::vector<double> times;
  for (double t = 0.0; t <= (moves ? scene.seconds : 0.0); t += scene.seconds > 100 ? 5.0 : 0.2)
    times.push_back(t);
  return times;
}

struct Thing {
  Solid solid;
  std::string name;
  std::size_t owner;  ///< one owner for the trunk and the crown of a tree
};

std::vector<Thing> thingsOf(const Scene& scene, double t) {
  std::vector<Thing> things;
  for (std::size_t i = 0; i < scene.props.size(); ++i) {
    for (const Solid& solid : solidsOf(scene.props[i])) {
      things.push_back({solid, "prop " + std::to_string(i), i});
    }
  }
  for (const SceneObject& object : scene.objects) {
    if (!object.presentAt(t)) continue;
    things.push_back({solidOf(object, t), object.class_name + " " + std::to_string(object.id),
                      scene.props.size() + object.id});
  }
  return things;
}

class EveryScene : public testing::TestWithParam<std::string> {};

TEST_P(EveryScene, SaysWhatItProvesInOneSentence) {
  const Scene scene = makeScene(GetParam(), 1, {});
  EXPECT_EQ(scene.name, GetParam());
  EXPECT_GT(scene.proves.size(), 30u);
  EXPECT_TRUE(scene.proves.ends_with('.'));
  EXPECT_GT(scene.seconds, 0.0);
  EXPECT_FALSE(scene.objects.empty());
}

TEST_P(EveryScene, HasNothingThatStandsInSomethingElse) {
  for (const std::uint64_t seed : seedsOf(GetParam())) {
    const Scene scene = makeScene(GetParam(), seed, {});
    for (const double t : timesOf(scene)) {
      const auto things = thingsOf(scene, t);
      for (std::size_t i = 0; i < things.size(); ++i) {
        for (std::size_t j = i + 1; j < things.size(); ++j) {
          if (things[i].owner == things[j].owner) continue;
          ASSERT_FALSE(meet(things[i].solid, things[j].solid, -1e-6))
              << "seed " << seed << ", " << t << " s: " << things[i].name << " and "
              << things[j].name;
        }
      }
    }
  }
}

TEST_P(EveryScene, LetsItsBodyPass) {
  for (const std::uint64_t seed : seedsOf(GetParam())) {
    const Scene scene = makeScene(GetParam(), seed, {});
    const bool views = GetParam() == "random";  // between its views, the body has no valid place
    const double clearance = onVehicle(scene) ? 1.0 : 0.15, step = views ? 1.0 : 0.1;
    std::vector<Thing> things = thingsOf(scene, 0.0);
    const bool moving = timesOf(scene).size() > 1;
    for (double t = 0.0; t <= scene.seconds; t += step) {
      const Eigen::Vector3d p = scene.body.poseAt(t).p;
      if (moving) things = thingsOf(scene, t);
      for (const Thing& thing : things) {
        const bool over_it = p.z() - 0.15 > thing.solid.high && !onVehicle(scene);
        const bool under_it = thing.solid.low > p.z() + 0.3;
        if (over_it || under_it) continue;
        ASSERT_GT(distanceTo(thing.solid, p.head<2>()), clearance)
            << "seed " << seed << ", " << t << " s: " << thing.name;
      }
    }
  }
}

TEST_P(EveryScene, HasEverythingStandOnTheGroundOrOnSomething) {
  for (const std::uint64_t seed : seedsOf(GetParam())) {
    const Scene scene = makeScene(GetParam(), seed, {});
    for (const double t : timesOf(scene)) {
      const auto things = thingsOf(scene, t);
      for (const Thing& thing : things) {
        const double low = thing.solid.low;
        const bool carried = std::any_of(things.begin(), things.end(), [&](const Thing& other) {
          return std::abs(other.solid.high - low) < 1e-6 &&
                 distanceTo(other.solid, thing.solid.centre) == 0.0;
        });
        ASSERT_TRUE(std::abs(low) < 1e-6 || carried) << "seed " << seed << ": " << thing.name;
      }
    }
  }
}

TEST_P(EveryScene, MovesAsBodiesCan) {
  if (GetParam() == "random") return;  // single views with jumps in between
  for (const std::uint64_t seed : seedsOf(GetParam())) {
    const Scene scene = makeScene(GetParam(), seed, {});
    for (double t = -1.0; t <= scene.seconds; t += 0.02) {
      const MotionState state = scene.body.at(t);
      ASSERT_LT(state.acceleration_W.norm(), 3.5) << "seed " << seed << ", " << t << " s";
      ASSERT_LT(state.velocity_W.norm(), 11.0);
      ASSERT_LT(state.angular_velocity_B.norm(), 2.0) << "seed " << seed << ", " << t << " s";
      ASSERT_LT(state.angular_acceleration_B.norm(), 8.0) << "seed " << seed << ", " << t << " s";
      // Every drive begins at rest, so that a filter can estimate the biases.
      if (t < 0.8) {
        ASSERT_LT(state.velocity_W.norm(), 0.03) << t;
      }
    }
    for (const SceneObject& object : scene.objects) {
      for (double t = 0.0; object.moves && !object.steps && t <= scene.seconds; t += 0.05) {
        if (object.presentAt(t)) {
          ASSERT_LT(object.motion.at(t).acceleration_W.norm(), 4.0) << object.id << ", " << t;
        }
      }
    }
  }
}

TEST_P(EveryScene, IsTheSameTwiceAndAnotherWithAnotherSeed) {
  const Scene a = makeScene(GetParam(), 5, {}), b = makeScene(GetParam(), 5, {});
  const Scene c = makeScene(GetParam(), 6, {});
  ASSERT_EQ(a.objects.size(), b.objects.size());
  for (std::size_t i = 0; i < a.objects.size(); ++i) {
    EXPECT_EQ(a.objects[i].look_seed, b.objects[i].look_seed);
    EXPECT_EQ(a.objects[i].size, b.objects[i].size);
    EXPECT_EQ(a.objects[i].motion.poseAt(3).p, b.objects[i].motion.poseAt(3).p);
  }
  ASSERT_EQ(a.props.size(), b.props.size());
  EXPECT_EQ(a.body.poseAt(10).p, b.body.poseAt(10).p);
  EXPECT_NE(a.objects[0].look_seed, c.objects[0].look_seed);
}

TEST_P(EveryScene, IsAPrefixOfItselfWhenItIsShort) {
  SceneOptions options;
  options.seconds = 9.0;
  const Scene shorter = makeScene(GetParam(), 7, options), longer = makeScene(GetParam(), 7, {});
  EXPECT_EQ(shorter.seconds, 9.0);
  for (double t = 0.0; t < 9.0; t += 0.5) {
    EXPECT_LT(boxMinus(shorter.body.poseAt(t), longer.body.poseAt(t)).norm(), 1e-9) << t;
  }
}

TEST_P(EveryScene, HasLooksOfItsOwnSetOnly) {
  std::array<std::set<std::uint64_t>, 3> looks;
  const std::array<std::string, 3> sets{"use", "train", "test"};
  for (std::size_t i = 0; i < sets.size(); ++i) {
    SceneOptions options;
    options.look_set = sets[i];
    const Scene scene = makeScene(GetParam(), 1, options);
    for (const SceneObject& object : scene.objects) looks[i].insert(object.look_seed);
    for (const Prop& prop : scene.props) looks[i].insert(prop.look_seed);
    for (const std::uint64_t look : looks[i]) EXPECT_EQ(look >> 56U, i);
  }
  EXPECT_GT(looks[1].size(), 3u);
}

TEST_P(EveryScene, KeepsToItsOptions) {
  SceneOptions options;
  options.stereo = options.rolling_shutter = true;
  options.noise = false;
  options.width = 320, options.height = 240, options.rate_hz = 10.0;
  const Scene scene = makeScene(GetParam(), 1, options);
  const auto& cameras = scene.rig.calibration.cameras;
  ASSERT_EQ(cameras.size(), 2u);
  ASSERT_EQ(scene.rig.cameras.size(), 2u);
  const Eigen::Vector3d apart = cameras[0].T_BC.inverse() * cameras[1].T_BC.p;
  EXPECT_NEAR(apart.x(), onVehicle(scene) ? 0.5 : 0.12, 1e-9);
  EXPECT_NEAR(apart.norm(), apart.x(), 1e-9);
  for (const auto& camera : cameras) {
    EXPECT_EQ(camera.width, 320u);
    EXPECT_EQ(camera.height, 240u);
    EXPECT_EQ(camera.rate_hz, 10.0);
    EXPECT_GT(camera.readout_s, 0.0);
    // A point ahead of the body is in the middle of the image, and up in the world is up in the
    // image.
    const CameraModel model(camera);
    const auto ahead = model.project(camera.T_BC.inverse() * Eigen::Vector3d(50, 0, 0));
    const auto above = model.project(camera.T_BC.inverse() * Eigen::Vector3d(50, 0, 5));
    const auto left = model.project(camera.T_BC.inverse() * Eigen::Vector3d(50, 5, 0));
    ASSERT_TRUE(ahead && above && left);
    EXPECT_NEAR(ahead->x(), 160.0, 6.0);
    EXPECT_LT(above->y(), ahead->y());
    EXPECT_LT(left->x(), ahead->x());
  }
  EXPECT_FALSE(scene.rig.imu.noise);
  EXPECT_EQ(scene.rig.imu.gyro_bias.norm(), 0.0);
  EXPECT_EQ(scene.rig.cameras[0].noise_electrons, 0.0);
}

INSTANTIATE_TEST_SUITE_P(All, EveryScene, testing::ValuesIn(allNames()),
                         [](const auto& name) { return name.param; });

TEST(Scenes, AreThoseThatTheHandbookNames) {
  const auto names = allNames();
  for (const char* name :
       {"street", "room", "toy", "occlusion", "vanish", "row", "roll", "still", "straight",
        "traffic", "town", "suburb", "blocks", "kilometre", "random", "lap"}) {
    EXPECT_THAT(names, Contains(name));
  }
}

TEST(Scenes, RefuseWhatIsNotKnown) {
  const auto complaint = [](const std::string& name, const SceneOptions& options) -> std::string {
    try {
      makeScene(name, 1, options);
    } catch (const StartupError& error) {
      EXPECT_EQ(error.code(), ExitCode::kUsage);
      return error.what();
    }
    return "";
  };
  EXPECT_THAT(complaint("moon", {}), HasSubstr("street, room, toy"));
  SceneOptions options;
  options.look_set = "mine";
  EXPECT_THAT(complaint("street", options), HasSubstr("use, train, test"));
  options = {};
  options.seconds = -1.0;
  EXPECT_THAT(complaint("street", options), HasSubstr("seconds"));
  options = {};
  options.rate_hz = 0.0;
  EXPECT_THAT(complaint("street", options), HasSubstr("frames a second"));
  options = {};
  options.width = 1;
  EXPECT_THAT(complaint("street", options), HasSubstr("pixels"));
}

}  // namespace
}  // namespace perdure::sim
