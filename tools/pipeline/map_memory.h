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
  /// Begins an empty map. `recalled` gets the answers. Throws StartupError.
  MapMemory(map_store::Config config, const std::filesystem::path& file, InstanceId instance,
            Sink<Recalled> recalled);

  void onOdometry(const Odometry& odometry);
  void onObjects(const Objects& objects);
  void onEvent(const Event& event);
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
