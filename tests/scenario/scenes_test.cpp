// Tests the filter in each scene with three seeds against its bars. Prints a table with each bar,
// the measured value, and the reason for each known failure.
#include <gtest/gtest.h>

#include "tests/scenario/bars.h"
#include "tests/scenario/known_failures.h"

namespace perdure::test {
namespace {

void holdScene(const std::string& scene) {
  holdSeeds(barsOf(scene, {1, 2, 3}), knownFailures(scene, "seeds"));
}

TEST(Scene, Toy) { holdScene("toy"); }
TEST(Scene, Still) { holdScene("still"); }
TEST(Scene, Occlusion) { holdScene("occlusion"); }
TEST(Scene, Vanish) { holdScene("vanish"); }
TEST(Scene, Room) { holdScene("room"); }
TEST(Scene, Row) { holdScene("row"); }
TEST(Scene, Roll) { holdScene("roll"); }
TEST(Scene, Traffic) { holdScene("traffic"); }
TEST(Scene, Street) { holdScene("street"); }

/// Scene `street` with a smaller working set, so that most objects leave it on each lap.
TEST(Scene, StreetRecalled) {
  const Outcome run = runScene(
      {.scene = "street",
       .assignments = {"semantic_filter.memory.recall_m=35", "semantic_filter.memory.margin_m=6",
                       "semantic_filter.memory.after_s=3.2"}});
  holdSeeds({streetBars(run) + commonBars(run) +
             Bars{atLeast(30, "objects that came back from the map",
                          number(run.countEvents("recalled")))}},
            knownFailures("street", "recalled"));
}

/// Rendered at 20 frames per second, with vio, and with wheel speeds if the carrier has wheels.
void holdWithVio(const std::string& scene) {
  const Setting setting{.scene = scene, .rate_hz = 20.0, .images = true};
  holdSeeds(barsOf(scene, {1, 2, 3}, setting), knownFailures(scene, "vio"));
}

TEST(LongSceneVio, Toy) { holdWithVio("toy"); }
TEST(LongSceneVio, Still) { holdWithVio("still"); }
TEST(LongSceneVio, Occlusion) { holdWithVio("occlusion"); }
TEST(LongSceneVio, Vanish) { holdWithVio("vanish"); }
TEST(LongSceneVio, Room) { holdWithVio("room"); }
TEST(LongSceneVio, Row) { holdWithVio("row"); }
TEST(LongSceneVio, Roll) { holdWithVio("roll"); }
TEST(LongSceneVio, Traffic) { holdWithVio("traffic"); }
TEST(LongSceneVio, Street) { holdWithVio("street"); }

TEST(LongScene, Town) {
  const Outcome run = runScene({.scene = "town", .seconds = 120.0, .rate_hz = 5.0});
  const Eigen::Vector3d here = run.truth.body.poses().back().T_WB.p;
  double kept = 0.0;
  for (const auto& object : run.objects) {
    kept += object.working && (object.centre - here).norm() > 150.0 ? 1.0 : 0.0;
  }
  hold(commonBars(run) + Bars{atMost(0, "objects in the working set more than 150 m away", kept)});
}

TEST(LongScene, Straight) {
  const Outcome run = runScene({.scene = "straight", .rate_hz = 20.0, .images = true});
  hold({atMost(1.0, "drift of vio with one camera and wheels, % of the way",
               run.trajectory.segments.t_err_percent),
        atMost(0.5, "ATE aligned in position and yaw, metres", run.trajectory.ate_rmse_m)});
}

}  // namespace
}  // namespace perdure::test
