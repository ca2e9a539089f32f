// A filter and a map store, connected as by the bus, on a drive along a street.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <set>
#include <utility>

#include "services/map_store/node.h"
#include "services/semantic_filter/node.h"
#include "tests/services/map_store/beliefs.h"
#include "tests/services/semantic_filter/scene.h"

namespace perdure::semantic_filter::testing {

using map_store::test::TemporaryFolder;

inline const std::vector<TrueObject> kStreet = {
    {makeState(18, 3.5, 0.75, 0.1, 4.3, 1.75, 1.5), "car"},
    {makeState(22, -4.0, 0.75, 3.0, 4.0, 1.7, 1.45), "car"},
    {makeState(30, 4.0, 0.75, 0.0, 4.4, 1.8, 1.5), "car"}};

inline constexpr MemoryParameters kMemory{true, 100.0, 30.0, 5.0};

inline Config configWith(const MemoryParameters& memory) {
  Config config;
  config.filter.memory = memory;
  return config;
}

/// The body always faces along x. It weaves, which gives parallax.
inline RigidTransform bodyAt(double x) {
  return RigidTransform(
      Eigen::Quaterniond(Eigen::AngleAxisd(0.05 * std::sin(0.1 * x), Eigen::Vector3d::UnitZ())),
      Eigen::Vector3d(x, 0.8 * std::sin(0.15 * x), 1.2));
}

inline std::vector<Detection> boxesFrom(const RigidTransform& T_WB, std::uint64_t k,
                                        const std::vector<TrueObject>& things = kStreet) {
  static const CameraModel camera{makeCamera()};
  std::mt19937 random(static_cast<std::uint32_t>(k));
  View view;
  view.camera = &camera;
  view.T_WB = T_WB;
  std::vector<Detection> list;
  for (const auto& o : things) {
    if (auto d = detect(o, view, BoxParameters{}, 0.5, 3.0, random)) list.push_back(*d);
  }
  return list;
}

/// A filter and a map store, connected as by the bus. While `deaf`, they exchange nothing.
struct Pair {
  TemporaryFolder folder;
  std::vector<Objects> objects;
  std::vector<Event> events;
  Predictions predictions;  ///< predictions of the newest frame
  std::vector<std::function<void()>> to_map;
  bool deaf = false;
  bool precise = false;  ///< the odometry reports increments that are precise to .1 mm a frame
  std::unique_ptr<map_store::Node> map;
  std::uint64_t frame = 0;
  double x = 0.0;
  std::vector<TrueObject> things;
  WorldId world{5, 0};
  RigidTransform T_W;  ///< the frame of the objects in the frame of the odometry
  Node filter;

  explicit Pair(const Config& config = configWith(kMemory),
                const std::vector<TrueObject>& street = kStreet, bool graph = true)
      : things(street),
        filter(config, makePriors(), 9,
               {.objects =
                    [this](const Objects& m) {
                      objects.push_back(m);
                      if (!deaf) to_map.push_back([this, m] { map->onObjects(m); });
                    },
                .events = [this](const Event& e) { events.push_back(e); },
                .predictions = [this](const Predictions& p) { predictions = p; }}) {
    map = std::make_unique<map_store::Node>(
        storeIn(folder, graph), 5, outputsTo([this](const MapNear& m) { filter.onNear(m); }));
    map->onQuery(helloOf(filter));
    filter.onCalibration(calibrationOf(makeCamera()));
    filter.onModel(makeModelInfo());
  }

  static map_store::Config storeIn(const TemporaryFolder& folder, bool graph = true) {
    map_store::Config store;
    store.graph = graph;
    store.store_path = folder.file("map.sqlite");
    return store;
  }
  static map_store::Outputs outputsTo(Sink<MapNear> near) {
    return {[](const MapTile&) {}, [](const MapTile&) {}, [](const MapHeader&) {},
            [](const MapReply&) {}, std::move(near)};
  }
  /// The query of a filter before its first frame.
  static MapQuery helloOf(const Node& filter) {
    MapQuery query;
    query.client = filter.instance();
    query.request = 1;
    query.kind = MapQueryKind::kRestore;
    return query;
  }

  void talk() {
    for (const auto& message : std::exchange(to_map, {})) message();
    if (!deaf) map->tick(stampOf(frame).time.time_since_epoch());
  }
  /// Sends the pose of the frame to filter and map store.
  void move() {
    Odometry odometry = odometryAt(frame, T_W * bodyAt(x));
    odometry.world = world;
    if (precise) {
      odometry.has_increment = frame > 0;
      odometry.increment_from = frame - 1;
      odometry.increment_covariance.diagonal() << 1e-14, 1e-14, 1e-14, 1e-8, 1e-8, 1e-8;
    }
    if (!deaf) to_map.push_back([this, odometry] { map->onOdometry(odometry); });
    filter.onOdometry(odometry);
  }
  /// Drives to `until` with `step` metres per frame. All objects in view are detected.
  void driveTo(double until, double step = 0.4) {
    const double way = until > x ? step : -step;
    for (; std::abs(until - x) > 0.5 * step; x += way, ++frame) {
      move();
      filter.onDetections(detectionsAt(frame, boxesFrom(bodyAt(x), frame, things)));
      talk();
    }
  }
  std::size_t count(EventKind kind) const {
    return static_cast<std::size_t>(std::count_if(events.begin(), events.end(),
                                                  [&](const Event& e) { return e.kind == kind; }));
  }
  std::set<ObjectId> confirmed() const {
    std::set<ObjectId> ids;
    for (const auto& o : objects.back().objects) {
      if (o.confirmed) ids.insert(o.id);
    }
    return ids;
  }
};

}  // namespace perdure::semantic_filter::testing
