#include "tests/bench/look_bench/town.h"

#include <algorithm>
#include <cmath>
#include <queue>

#include "services/semantic_filter/core/visibility/detectability.h"
#include "services/semantic_filter/core/visibility/occlusion.h"

namespace perdure::semantic_filter::bench {
namespace {

using testing::makeState;

constexpr double kHouse_m = 8.0;  // from the middle of a street to the houses
constexpr double kSide_m = 4.5;   // from the middle of a street to a parked car
constexpr double kRange_m = 60.0;

int idOf(int column, int row) { return row * kNodes + column; }

/// Returns the distances in streets from `from` to all crossings.
std::vector<int> distancesFrom(const Town& town, int from) {
  std::vector<int> distance(kNodes * kNodes, -1);
  std::queue<int> next({from});
  distance[from] = 0;
  for (; !next.empty(); next.pop()) {
    for (const int n : town.adjacentTo(next.front())) {
      if (distance[n] >= 0) continue;
      distance[n] = distance[next.front()] + 1;
      next.push(n);
    }
  }
  return distance;
}

template <class T>
T anyOf(const std::vector<T>& items, std::mt19937& random) {
  return items[std::uniform_int_distribution<std::size_t>(0, items.size() - 1)(random)];
}

/// Returns a walk through all streets that takes the next new street, or goes to the nearest one.
Walk someTour(const Town& town, int start, std::mt19937& random) {
  Walk walk{start};
  std::vector<bool> walked(town.streets().size(), false);
  for (std::size_t left = walked.size(); left > 0;) {
    const int at = walk.back();
    const auto isNew = [&](int a, int b) { return !walked[*town.streetBetween(a, b)]; };
    std::vector<int> fresh;
    for (const int n : town.adjacentTo(at)) {
      if (isNew(at, n)) fresh.push_back(n);
    }
    if (!fresh.empty()) {
      walk.push_back(anyOf(fresh, random));
      walked[*town.streetBetween(at, walk.back())] = true;
      --left;
      continue;
    }
    const auto distance = distancesFrom(town, at);
    int target = -1;
    for (int n = 0; n < kNodes * kNodes; ++n) {
      const auto& adjacent = town.adjacentTo(n);
      const bool begins =
          std::any_of(adjacent.begin(), adjacent.end(), [&](int m) { return isNew(n, m); });
      if (begins && (target < 0 || distance[n] < distance[target])) target = n;
    }
    const auto back = distancesFrom(town, target);
    while (walk.back() != target) {
      const auto& adjacent = town.adjacentTo(walk.back());
      walk.push_back(*std::min_element(adjacent.begin(), adjacent.end(),
                                       [&](int a, int b) { return back[a] < back[b]; }));
    }
  }
  return walk;
}

}  // namespace

Town::Town(std::uint64_t seed) : adjacent_(kNodes * kNodes) {
  std::mt19937 random(static_cast<std::uint32_t>(seed));
  std::uniform_real_distribution<double> uniform;
  std::normal_distribution<double> normal;
  const auto add = [&](int a, int b) {
    streets_.push_back({a, b, uniform(random), std::exp(normal(random))});
    adjacent_[a].push_back(b), adjacent_[b].push_back(a);
  };
  for (int row = 0; row < kNodes; ++row) {
    for (int column = 0; column < kNodes; ++column) {
      if (column + 1 < kNodes) add(idOf(column, row), idOf(column + 1, row));
      if (row + 1 < kNodes) add(idOf(column, row), idOf(column, row + 1));
    }
  }
  for (std::size_t s = 0; s < streets_.size(); ++s) {
    const Eigen::Vector2d from = place(streets_[s].a);
    const Eigen::Vector2d along = (place(streets_[s].b) - from).normalized();
    for (double metres = 12.0; metres < kBlock_m - 10.0; metres += 6.5) {
      for (const double side : {-kSide_m, kSide_m}) {
        const Eigen::Vector2d p =
            from + metres * along + side * Eigen::Vector2d(-along.y(), along.x());
        const double yaw = std::atan2(along.y(), along.x()) + (side > 0 ? M_PI : 0.0);
        parking_.push_back({s, makeState(p.x(), p.y(), 0.75, yaw, 4.2, 1.75, 1.5),
                            uniform(random) < streets_[s].occupancy});
      }
    }
  }
}

std::optional<std::size_t> Town::streetBetween(int a, int b) const {
  for (std::size_t s = 0; s < streets_.size(); ++s) {
    if ((streets_[s].a == a && streets_[s].b == b) || (streets_[s].a == b && streets_[s].b == a)) {
      return s;
    }
  }
  return std::nullopt;
}

Eigen::Vector2d Town::place(int node) {
  return kBlock_m * Eigen::Vector2d(node % kNodes, node / kNodes);
}

bool Town::inSight(const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
  const auto inHouse = [](double x) {
    const double rest = x - kBlock_m * std::floor(x / kBlock_m);
    return rest > kHouse_m && rest < kBlock_m - kHouse_m;
  };
  const int steps = static_cast<int>((to - from).norm());
  for (int k = 1; k < steps; ++k) {
    const Eigen::Vector2d p = from + (to - from) * (static_cast<double>(k) / steps);
    if (inHouse(p.x()) && inHouse(p.y())) return false;
  }
  return true;
}

std::vector<TimedView> posesOf(const Walk& walk, double step_m, double start_s) {
  constexpr double kTurn = M_PI / 8.0;
  std::vector<TimedView> views;
  double t = start_s;
  const auto add = [&](const Eigen::Vector2d& p, double yaw) {
    views.push_back({{Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ())),
                      {p.x(), p.y(), 1.2}},
                     fromNanoseconds(std::llround(1e9 * t))});
    t += step_m / kSpeed;
  };
  std::optional<double> heading;
  for (std::size_t k = 1; k < walk.size(); ++k) {
    const Eigen::Vector2d from = Town::place(walk[k - 1]);
    const Eigen::Vector2d along = (Town::place(walk[k]) - from).normalized();
    const double yaw = std::atan2(along.y(), along.x());
    if (heading) {
      const double turn = std::remainder(yaw - *heading, 2.0 * M_PI);
      for (double part = kTurn; part < std::abs(turn); part += kTurn) {
        add(from, *heading + std::copysign(part, turn));
      }
    }
    heading = yaw;
    for (double s = 0.0; s < kBlock_m; s += step_m) add(from + s * along, yaw);
  }
  return views;
}

double lengthOf(const Walk& walk) { return kBlock_m * static_cast<double>(walk.size() - 1); }

Walk shortestTour(const Town& town, int start, std::mt19937& random) {
  constexpr int kTries = 300;
  Walk best = someTour(town, start, random);
  for (int k = 1; k < kTries; ++k) {
    Walk other = someTour(town, start, random);
    if (other.size() < best.size()) best = std::move(other);
  }
  return best;
}

Walk wander(const Town& town, int start, double metres, std::mt19937& random) {
  Walk walk{start};
  while (lengthOf(walk) < metres) {
    std::vector<double> weights;
    for (const int n : town.adjacentTo(walk.back())) {
      const bool back = walk.size() > 1 && n == walk[walk.size() - 2];
      weights.push_back(back ? 0.0
                             : town.streets()[*town.streetBetween(walk.back(), n)].popularity);
    }
    std::discrete_distribution<std::size_t> choice(weights.begin(), weights.end());
    walk.push_back(town.adjacentTo(walk.back())[choice(random)]);
  }
  return walk;
}

std::vector<Detection> see(Town& town, const TimedView& timed, const CameraModel& camera,
                           std::mt19937& random) {
  const ScratchScope scope;
  const View view{&camera, timed.T_WB, Eigen::Vector3d::UnitZ()};
  const Projector from(view);
  const Eigen::Vector2d eye = from.T_WC.p.head<2>();
  std::vector<Parking*> near;
  ScratchVector<Outline> outlines;
  for (Parking& p : town.parking()) {
    if ((p.car.head<2>() - eye).norm() > kRange_m || !Town::inSight(eye, p.car.head<2>())) continue;
    Track track = testing::makeObject(near.size() + 1, "car", p.car, 1e-4);
    // An empty place hides nothing.
    track.existence = {p.taken ? 1.0 : 0.0, ExistenceEvidence::kPrior, {}};
    near.push_back(&p);
    outlines.push_back(outlineOf(track, p.car, from));
  }
  const auto visible = computeVisibility(outlines, {}, camera.width(), camera.height(), {});
  std::uniform_real_distribution<double> uniform;
  std::vector<Detection> boxes;
  for (std::size_t k = 0; k < near.size(); ++k) {
    if (visible[k].fraction <= 0.0) continue;
    near[k]->seen_s = std::max(near[k]->seen_s, toSeconds(timed.time));
    if (!near[k]->taken || uniform(random) > 0.9 * visible[k].fraction) continue;
    auto box = testing::detect({near[k]->car, "car"}, view, {}, 0.5, 3.0, random);
    if (box && box->box.height() > 14.0) boxes.push_back(*box);
  }
  if (uniform(random) < 0.2) {
    Detection clutter;
    const double x = uniform(random) * 1000.0, y = uniform(random) * 200.0;
    clutter.box = {x, y, x + 20.0 + 100.0 * uniform(random), y + 20.0 + 60.0 * uniform(random)};
    clutter.activations = {0.0F, -0.5F, -2.0F, -2.0F, -2.0F};
    boxes.push_back(clutter);
  }
  return boxes;
}

}  // namespace perdure::semantic_filter::bench
