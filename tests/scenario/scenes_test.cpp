// What the filter does in each scene, against the bars that it is to pass. Each table says what is
// asked, what was measured, and, where a bar is not passed yet, why.
#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "common/types/objects.h"
#include "tests/scenario/scenario.h"

namespace perdure::test {
namespace {

using Bars = std::vector<Bar>;

Bars operator+(Bars bars, const Bars& more) {
  bars.insert(bars.end(), more.begin(), more.end());
  return bars;
}

double number(std::size_t count) { return static_cast<double>(count); }

Eigen::Vector3d placeAtEnd(const Outcome& run, const sim::TruthObject& object) {
  return object.at(run.truth.frames.back()).centre_W;
}

TEST(Scene, Toy) {
  const Outcome run = runScene({.scene = "toy"});
  double cars = 0.0;
  for (const auto& car : run.standing("car")) {
    const Eigen::Vector3d place = car.keys[0].centre_W;
    cars += run.countNear(place, 0.1 * place.norm(), "car") > 0 ? 1.0 : 0.0;
  }
  const auto toys = run.standing("toy");
  ASSERT_EQ(toys.size(), 1U);
  const Eigen::Vector3d toy = toys[0].keys[0].centre_W;
  const double called_car = number(Outcome::idsNear(run.inst_rows, toy, 1.0, "car").size());
  hold({atLeast(3, "true cars that are cars on the map, place to 10 %", cars,
                "1: at 29 m and more the sideways metre places nothing to the metre that "
                "`confirm` asks for, so they stay unconfirmed"),
        atMost(0, "cars that were ever claimed within 1 m of the toy", called_car),
        atLeast(1, "things of no known class within 0.3 m of the toy",
                number(run.countNear(toy, 0.3, kOtherClass)))});
}

TEST(Scene, Occlusion) {
  const Outcome run = runScene({.scene = "occlusion"});
  sim::TruthObject hidden;
  for (const auto& chair : run.standing("chair")) {
    const bool in_line = std::abs(chair.keys[0].centre_W.y()) < 0.2 &&
                         std::abs(chair.keys[0].centre_W.x() - 1.0) < 0.2;
    if (in_line) hidden = chair;
  }
  ASSERT_EQ(hidden.class_name, "chair");
  const Eigen::Vector3d place = hidden.keys[0].centre_W;
  const auto ids = Outcome::idsNear(run.inst_rows, place, 0.4, "chair");
  hold(commonBars(run) +
       Bars{atMost(1, "ids of the hidden chair", number(ids.size())),
            atLeast(1, "times it was known to be hidden", number(run.countEvents("occluded", ids))),
            atMost(0, "times it was given up", number(run.countEvents("gone", ids))),
            atLeast(1, "chairs at its place at the end",
                    number(run.countNear(place, 0.4, "chair")))});
}

TEST(Scene, Vanish) {
  const Outcome run = runScene({.scene = "vanish"});
  const TimePoint start = run.truth.frames.front(), end = run.truth.frames.back();
  const sim::TruthObject *taken = nullptr, *moved = nullptr;
  for (const auto& object : run.truth.truth.objects) {
    if (object.presentAt(start) && !object.presentAt(end)) taken = &object;
    if (object.keys.size() > 1) moved = &object;
  }
  ASSERT_NE(taken, nullptr);
  ASSERT_NE(moved, nullptr);
  hold(commonBars(run) +
       Bars{atMost(0, "chairs where the one was that was taken away",
                   number(run.countNear(taken->keys[0].centre_W, 0.5, "chair"))),
            atMost(0, "chairs where the other was before it was moved",
                   number(run.countNear(moved->keys[0].centre_W, 0.5, "chair"))),
            atLeast(1, "chairs where it is now",
                    number(run.countNear(placeAtEnd(run, *moved), 0.5, "chair")))});
}

TEST(Scene, Row) {
  const Outcome run = runScene({.scene = "row"});
  const auto cars = run.standing("car");
  double found = 0.0, doubled = 0.0;
  for (const auto& car : cars) {
    const std::size_t here = run.countNear(car.keys[0].centre_W, 1.2, "car");
    found += here > 0 ? 1.0 : 0.0;
    doubled += here > 1 ? 1.0 : 0.0;
  }
  hold(commonBars(run) +
       Bars{atLeast(number(cars.size()), "cars of the row that are on the map at the end", found),
            atMost(0, "cars that are on the map twice", doubled)});
}

TEST(Scene, Roll) {
  const Outcome run = runScene({.scene = "roll"});
  hold(commonBars(run, {.recall = "0.79 (to 0.83 by small changes): what smoothing finds little to "
                                  "mend at waits for three times as many new looks"}) +
       Bars{atMost(0.5, "mean position error of what is found under 1 m",
                   run.final.cells[1][2].positionError())});
}

TEST(Scene, Traffic) {
  const Outcome run = runScene({.scene = "traffic"});
  double left_over = 0.0;
  for (const auto& object : run.believed()) {
    double nearest = 1e9;
    for (const auto& one : run.truth.truth.objects) {
      nearest = std::min(nearest, (placeAtEnd(run, one) - object.centre).norm());
    }
    left_over += object.moving < 0.5 && nearest > 3.0 ? 1.0 : 0.0;
  }
  hold(commonBars(run) +
       Bars{atMost(0, "standing things on the map where nothing is", left_over,
                   "6 (0 to 6, by small changes): what a moving car leaves behind where it was "
                   "first believed to stand")});
}

/// The id that is claimed most often within 1 m of a place, in these frames; 0: none.
std::uint64_t mostClaimed(const std::vector<tools::EstimateRow>& rows, const Eigen::Vector3d& place,
                          std::uint64_t from, std::uint64_t until) {
  std::map<std::uint64_t, int> claims;
  for (const auto& row : rows) {
    const bool near = (row.centre_W - place).norm() < 1.0;
    if (near && row.frame >= from && row.frame < until) ++claims[row.id];
  }
  std::uint64_t best = 0;
  for (const auto& [id, count] : claims) best = best == 0 || count > claims[best] ? id : best;
  return best;
}

/// Of the things that were claimed in both halves of the run: the share that kept their id.
double keptIds(const Outcome& run) {
  const std::uint64_t all = run.truth.frames.size();
  double both = 0.0, kept = 0.0;
  for (const auto& object : run.truth.truth.objects) {
    if (object.moves || object.keys.size() != 1) continue;
    const Eigen::Vector3d place = object.keys[0].centre_W;
    const auto first = mostClaimed(run.inst_rows, place, 0, all / 2);
    const auto second = mostClaimed(run.inst_rows, place, all / 2, all);
    if (first == 0 || second == 0) continue;
    both += 1.0;
    kept += first == second ? 1.0 : 0.0;
  }
  return both > 0.0 ? kept / both : 0.0;
}

constexpr char kLosesIds[] =
    ".94 to .96 (.92 to .98 over six seeds, with recall as without): taken for moving on the first "
    "lap and given up out of view, or two beliefs in one thing";

TEST(Scene, StreetTwice) {
  const Outcome run = runScene({.scene = "street"});
  hold(commonBars(run) +
       Bars{atMost(0, "switches of id", number(run.final.id_switches)),
            atLeast(0.98, "second lap: share that keeps the id of the first", keptIds(run),
                    kLosesIds),
            atMost(1.02, "objects of the map for each one found", run.final.idsPerFound())});
}

/// The same street, most of which leaves the working set on each lap.
TEST(Scene, StreetRecalled) {
  const Outcome run = runScene(
      {.scene = "street",
       .assignments = {"semantic_filter.memory.recall_m=35", "semantic_filter.memory.margin_m=6",
                       "semantic_filter.memory.after_s=3.2"}});
  hold(commonBars(run) +
       Bars{atLeast(30, "objects that came back from the map", number(run.countEvents("recalled"))),
            atLeast(0.98, "second lap: share that keeps the id of the first", keptIds(run),
                    kLosesIds)});
}

TEST(Scene, Still) {
  const Outcome run = runScene({.scene = "still"});
  double surely_wrong = 0.0;
  for (const auto& object : run.believed()) {
    double best = 1e9;  // squared deviations to the truth that fits best
    for (const auto& one : run.truth.truth.objects) {
      const Eigen::Vector3d error = object.centre - one.keys[0].centre_W;
      best = std::min(best, error.dot(object.covariance.ldlt().solve(error)));
    }
    surely_wrong += best > 14.2 ? 1.0 : 0.0;  // the 99.73 % quantile of χ², three degrees
  }
  hold({atMost(0, "things believed where nothing is, by 3 sigma", surely_wrong),
        atMost(0, "true things that were given up for want of parallax",
               number(run.countEvents("gone")))});
}

TEST(Scene, Room) {
  const Outcome run = runScene({.scene = "room"});
  hold(commonBars(run, {.duplicates = "1.07: chairs close together change their ids"}));
}

TEST(LongScene, Town) {
  const Outcome run = runScene({.scene = "town", .seconds = 120.0, .rate_hz = 5.0});
  const Eigen::Vector3d here = run.truth.body.poses().back().T_WB.p;
  double kept = 0.0;
  for (const auto& object : run.objects) {
    kept += object.working && (object.centre - here).norm() > 150.0 ? 1.0 : 0.0;
  }
  hold(commonBars(run) + Bars{atMost(0, "things in the working set more than 150 m away", kept)});
}

TEST(LongScene, Straight) {
  const Outcome run = runScene({.scene = "straight", .rate_hz = 20.0, .images = true});
  hold({atMost(1.0, "drift of vio with one camera and wheels, % of the way",
               run.trajectory.segments.t_err_percent),
        atMost(0.5, "ATE aligned in position and yaw, metres", run.trajectory.ate_rmse_m)});
}

}  // namespace
}  // namespace perdure::test
