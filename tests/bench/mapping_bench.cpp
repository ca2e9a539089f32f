// Measures the cost of the pose graph for a drive through a grid of streets with ANCHORS anchors
// and LOOPS revisited places. It times the full optimisation, a second one from its result, one
// with one more loop, and the marginal covariances of 40 anchors relative to the last. Prints the
// CPU time of this thread, medians of five runs.
// usage: mapping_bench [ANCHORS LOOPS] (default: 5,000 and 100)
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <map>
#include <random>
#include <utility>
#include <vector>

#include "common/mapping/graph/marginals.h"

namespace {

using namespace perdure;
using namespace perdure::mapping;

constexpr int kRuns = 5;
constexpr std::size_t kAsked = 40;
constexpr double kStep = 12.0;
constexpr int kBlock = 10;    ///< steps between crossings
constexpr int kStreets = 16;  ///< number of streets in each direction

double cpuMs() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
}

Eigen::Matrix4d diagonal(double metres, double yaw) {
  return Eigen::Vector4d(metres * metres, metres * metres, metres * metres, yaw * yaw).asDiagonal();
}

struct Drive {
  std::vector<LevelPose> truth;
  std::vector<std::pair<std::size_t, std::size_t>> places;  ///< indices of both passes of each
                                                            ///< revisited place
};

Drive makeDrive(std::size_t anchors, std::mt19937& random) {
  Drive drive;
  std::map<std::pair<int, int>, std::size_t> passed;
  int x = 0, y = 0, heading = 0;
  const int dx[] = {1, 0, -1, 0}, dy[] = {0, 1, 0, -1};
  const auto inside = [](int at) { return at >= 0 && at < kStreets * kBlock; };
  for (std::size_t i = 0; i < anchors; ++i) {
    drive.truth.push_back({{kStep * x, kStep * y, 0.0}, heading * 1.5707963267948966});
    const auto [first, is_new] = passed.emplace(std::pair(x, y), i);
    if (!is_new && i > first->second + 40) drive.places.push_back({first->second, i});
    if (x % kBlock == 0 && y % kBlock == 0) {
      do {
        heading = (heading + 3 + static_cast<int>(random() % 3)) % 4;
      } while (!inside(x + dx[heading] * kBlock) || !inside(y + dy[heading] * kBlock));
    }
    x += dx[heading], y += dy[heading];
  }
  return drive;
}

class Measurements {
 public:
  explicit Measurements(const Drive& drive) : drive_(drive) {}
  LevelGaussian between(std::size_t a, std::size_t b, double metres, double yaw) {
    LevelPose T = drive_.truth[a].inverse() * drive_.truth[b];
    T.p += metres * Eigen::Vector3d(normal_(random_), normal_(random_), normal_(random_));
    T.yaw += yaw * normal_(random_);
    return {T, diagonal(metres, yaw)};
  }
  PoseGraph chain() {
    PoseGraph graph{{}};
    graph.addFirst(1, drive_.truth[0]);
    for (std::size_t i = 1; i < drive_.truth.size(); ++i) {
      graph.add(i + 1, i, between(i - 1, i, 0.03, 0.0005));
    }
    return graph;
  }
  void addLoop(PoseGraph& graph, std::size_t place, double wrong_by = 0.0) {
    const auto [a, b] = drive_.places[place];
    Edge loop{a + 1, b + 1, between(a, b, 0.3, 0.01), EdgeKind::kLoop};
    loop.T_ab.mean.p.x() += wrong_by;
    graph.add(loop);
  }

 private:
  const Drive& drive_;
  std::mt19937 random_{3};
  std::normal_distribution<double> normal_;
};

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

double worstError(const PoseGraph& graph, const Drive& drive) {
  double worst = 0.0;
  for (const auto& [id, pose] : graph.poses()) {
    worst = std::max(worst, (pose.p - drive.truth[id - 1].p).norm());
  }
  return worst;
}

}  // namespace

int main(int argc, char** argv) {
  const auto anchors = static_cast<std::size_t>(argc > 1 ? std::atol(argv[1]) : 5000);
  auto loops = static_cast<std::size_t>(argc > 2 ? std::atol(argv[2]) : 100);
  std::mt19937 random(5);
  Drive drive = makeDrive(anchors, random);
  std::shuffle(drive.places.begin(), drive.places.end(), random);
  if (drive.places.size() < 2) return 1;
  loops = std::min(loops, drive.places.size() - 1);
  std::vector<double> all, again, more, wrong, factors, asked;
  for (int run = 0; run < kRuns; ++run) {
    Measurements measurements(drive);
    PoseGraph graph = measurements.chain();
    for (std::size_t i = 0; i < loops; ++i) measurements.addLoop(graph, i);
    const double drifted = worstError(graph, drive);
    const auto optimise = [&](const char* what, std::vector<double>& times) {
      const double start = cpuMs();
      const OptimiseReport report = graph.optimise();
      times.push_back(cpuMs() - start);
      if (run > 0) return;
      double least = 1.0;
      for (const auto& [id, weight] : report.weights) least = std::min(least, weight);
      std::printf(
          "%-14s %2d iterations%s, cost %.1f, least weight %.2f, moved %.2f m, off by %.2f m\n",
          what, report.iterations, report.converged ? "" : " (not converged)", report.cost, least,
          report.largest_move_m, worstError(graph, drive));
    };
    if (run == 0) std::printf("%zu anchors, %zu loops, off by %.2f m\n", anchors, loops, drifted);
    optimise("all loops", all);
    optimise("once more", again);
    measurements.addLoop(graph, loops);
    optimise("one loop more", more);
    measurements.addLoop(graph, loops, 100.0);
    optimise("a wrong one", wrong);
    double start = cpuMs();
    const Marginals marginals(graph, anchors);
    factors.push_back(cpuMs() - start);
    start = cpuMs();
    for (std::size_t i = 0; i < kAsked; ++i) {
      if (!marginals.to(1 + i * (anchors - 1) / kAsked)) return 1;
    }
    asked.push_back(cpuMs() - start);
  }
  std::printf("ms: all loops %.1f, once more %.1f, one loop more %.1f, a wrong one %.1f\n",
              median(all), median(again), median(more), median(wrong));
  std::printf("ms: marginals %.2f, of %zu anchors %.2f\n", median(factors), kAsked, median(asked));
  return 0;
}
