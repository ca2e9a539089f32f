// Long-term memory of a run in one process: the map store's node on OUT/map.sqlite, as the bus
// would connect it with the filter.
#pragma once

#include <deque>
#include <filesystem>
#include <functional>

#include "services/map_store/node.h"

namespace perdure::tools {

class MapMemory {
 public:
  /// Removes the map of an earlier run.
  static void clear(const std::filesystem::path& file);
  /// A world that a stored map does not know. Throws StartupError.
  static std::uint64_t newWorld(const std::filesystem::path& map);
  /// Begins `file` as a copy of a stored map. Throws StartupError.
  static void copy(const std::filesystem::path& from, const std::filesystem::path& file);

  struct Sinks {
    Sink<MapNear> near;  ///< for the filter
    Sink<Event> events;       ///< what the map's graph has found
    Sink<MapFrame> frames;
    Sink<MapReply> replies;
  };
  /// Opens the map, or begins an empty one. Throws StartupError.
  MapMemory(map_store::Config config, const std::filesystem::path& file, InstanceId instance,
            Sinks sinks);

  /// Tells a filter which ids are taken.
  void giveIds(InstanceId filter, const WorldId& session);
  void onCalibration(const Calibration& calibration);
  void onOdometry(const Odometry& odometry);
  void onLandmarks(const Landmarks& landmarks);
  void onObjects(const Objects& objects);
  void onQuery(const MapQuery& query);
  /// Does what has come, in order: not while the filter is at work, since answers go to it.
  void work();
  /// Writes what is left.
  void finish();

  const ReasonCounts& reasons() const { return node_.reasons(); }
  const mapping::Mapper& mapper() const { return node_.mapper(); }

 private:
  map_store::Node node_;
  std::deque<std::function<void()>> waiting_;
};

}  // namespace perdure::tools
