// Measures the filter's cost per frame with SMALL and with LARGE objects on the map. The same
// hundred objects stand along the trajectory; all others stand in other streets. Runs each size
// five times, alternately. Prints the CPU time of this thread, and separately that of the map
// store, which is another process in operation.
// usage: memory_bench [SMALL LARGE [FRAMES]] (default: 100 and 100,000)
#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <ctime>

#include "services/map_store/node.h"
#include "tests/services/map_store/beliefs.h"
#include "tests/services/semantic_filter/scene.h"

namespace {

using namespace perdure;
using namespace perdure::semantic_filter;
using namespace perdure::semantic_filter::testing;

constexpr std::size_t kAlongTheWay = 100;
constexpr int kRuns = 5;

double cpuMs() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
}

/// Returns parked cars alternately on both sides of the trajectory, one every 4.5 m.
State parked(std::size_t i) {
  const double side = i % 2 == 0 ? 4.0 : -4.5;
  return makeState(10.0 + 4.5 * static_cast<double>(i), side, 0.75, 0.02, 4.2, 1.75, 1.5);
}

ObjectBelief beliefAt(ObjectId id, const Eigen::Vector3d& p) {
  ObjectBelief belief = map_store::test::carAt(id, p);
  belief.classes.resize(1);
  ClassBelief& car = belief.classes[0];
  car.probability = 1.0;
  car.mean << p, 0.02, std::log(4.2), std::log(1.75), std::log(1.5);
  car.covariance = Vector7d(0.04, 0.04, 0.01, 0.01, 0.0025, 0.0025, 0.0025).asDiagonal();
  car.cross_pose.setZero();
  return belief;
}

Objects mapOf(std::size_t count) {
  std::vector<ObjectBelief> beliefs;
  for (std::size_t i = 0; i < count; ++i) {
    const double row = static_cast<double>((i - kAlongTheWay) / 500);
    const double column = static_cast<double>((i - kAlongTheWay) % 500);
    const Eigen::Vector3d place = i < kAlongTheWay
                                      ? Eigen::Vector3d(parked(i).head<3>())
                                      : Eigen::Vector3d(5.0 * column, 300.0 + 20.0 * row, 0.75);
    beliefs.push_back(beliefAt(i + 1, place));
  }
  Objects objects = map_store::test::workingSet(1, std::move(beliefs));
  objects.world = {5, 0};
  return objects;
}

/// A map file with `count` objects, none of them in a working set.
class MapFile {
 public:
  explicit MapFile(std::size_t count) {
    map_store::Node node(config(), 5,
                         {[](auto&) {}, [](auto&) {}, [](auto&) {}, [](auto&) {}, [](auto&) {}});
    Objects objects = mapOf(count);
    node.onObjects(objects);
    node.tick(Duration(0));
    objects.stamp.sequence = 2;
    objects.objects.clear();
    node.onObjects(objects);
    node.flush();
  }
  map_store::Config config() const {
    map_store::Config config;
    config.store_path = folder_.file("map.sqlite");
    config.check_at_start = false;
    return config;
  }

 private:
  map_store::test::TemporaryFolder folder_;
};

struct Cost {
  double filter_ms = 0.0, store_ms = 0.0;  ///< per frame
  std::size_t recalled = 0;
};

Cost drive(const MapFile& file, std::uint64_t frames) {
  std::vector<Objects> objects;
  std::vector<MapNear> near;
  Cost cost;
  map_store::Node store(file.config(), 6,
                        {[](auto&) {}, [](auto&) {}, [](auto&) {}, [](auto&) {},
                         [&](const MapNear& m) { near.push_back(m); }});
  store.tick(Duration(0));  // publishes the whole map, once at its start
  Node filter(
      {}, makePriors(), 10,
      {.objects = [&](const Objects& m) { objects.push_back(m); },
       .events = [&](const Event& e) { cost.recalled += e.kind == EventKind::kRecalled ? 1 : 0; },
       .predictions = {}});
  filter.onCalibration(calibrationOf(makeCamera()));
  filter.onModel(makeModelInfo());
  const CameraModel camera{makeCamera()};
  std::mt19937 random(7);
  for (std::uint64_t k = 0; k < frames; ++k) {
    View view;
    view.camera = &camera;
    view.T_WB = RigidTransform(Eigen::Quaterniond::Identity(),
                               Eigen::Vector3d(static_cast<double>(k), 0.0, 1.2));
    std::vector<Detection> boxes;
    for (std::size_t i = 0; i < kAlongTheWay; ++i) {
      const State x = parked(i);
      const double ahead = x[0] - view.T_WB.p.x();
      if (ahead < 4.0 || ahead > 40.0) continue;
      if (auto d = detect({x, "car"}, view, BoxParameters{}, 0.5, 3.0, random)) boxes.push_back(*d);
    }
    double start = cpuMs();
    filter.onOdometry(odometryAt(k, view.T_WB));
    filter.onDetections(detectionsAt(k, boxes));
    cost.filter_ms += cpuMs() - start;
    start = cpuMs();
    for (const auto& m : std::exchange(objects, {})) store.onObjects(m);
    store.tick(stampOf(k).time.time_since_epoch());
    cost.store_ms += cpuMs() - start;
    start = cpuMs();
    for (const auto& m : std::exchange(near, {})) filter.onNear(m);
    cost.filter_ms += cpuMs() - start;
  }
  cost.filter_ms /= static_cast<double>(frames);
  cost.store_ms /= static_cast<double>(frames);
  return cost;
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

}  // namespace

int main(int argc, char** argv) {
  const std::array<std::size_t, 2> sizes = {
      std::max(kAlongTheWay, static_cast<std::size_t>(argc > 2 ? std::atol(argv[1]) : 100)),
      std::max(kAlongTheWay, static_cast<std::size_t>(argc > 2 ? std::atol(argv[2]) : 100'000))};
  const auto frames = static_cast<std::uint64_t>(argc > 3 ? std::atol(argv[3]) : 300);
  std::array<std::vector<double>, 2> filter, store;
  for (int run = 0; run < kRuns; ++run) {
    for (std::size_t i = 0; i < 2; ++i) {
      const MapFile file(sizes[i]);  // one for each run, because a drive changes the map
      const Cost cost = drive(file, frames);
      std::printf("%8zu things: filter %.3f ms, map store %.3f ms a frame, %zu recalled\n",
                  sizes[i], cost.filter_ms, cost.store_ms, cost.recalled);
      if (cost.recalled == 0) return 1;
      filter[i].push_back(cost.filter_ms), store[i].push_back(cost.store_ms);
    }
  }
  const double small = median(filter[0]), large = median(filter[1]);
  std::printf("medians: filter %.3f and %.3f ms (%+.1f %%, %+.3f ms), map store %.3f and %.3f ms\n",
              small, large, 100.0 * (large / small - 1.0), large - small, median(store[0]),
              median(store[1]));
  return 0;
}
