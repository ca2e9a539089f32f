// The map of a run: the map store's node with the file OUT/map.sqlite. It exchanges the same
// messages with the filter as on the bus.
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
  /// Returns a `world` that a stored map does not contain. Throws StartupError if the map is
  /// unusable.
  static std::uint64_t newWorld(const std::filesystem::path& map);
  /// Creates `file` as a copy of a stored map. Throws StartupError if `from` is unusable.
  static void copy(const std::filesystem::path& from, const std::filesystem::path& file);

  /// Opens the map, or creates an empty one. Throws StartupError if the file is unusable.
  MapMemory(map_store::Config config, const std::filesystem::path& file, InstanceId instance,
            map_store::Outputs outputs);

  /// Sends the next free object id to a filter.
  void giveIds(InstanceId filter, const WorldId& session);
  void onCalibration(const Calibration& calibration) { node_.onCalibration(calibration); }
  void onOdometry(const Odometry& odometry) { post(&map_store::Node::onOdometry, odometry); }
  void onLandmarks(const Landmarks& landmarks) { post(&map_store::Node::onLandmarks, landmarks); }
  void onObjects(const Objects& objects);
  void onQuery(const MapQuery& query) { post(&map_store::Node::onQuery, query); }
  /// Processes pending messages in order. Must not be called during a step of the filter, because
  /// the filter receives the answers.
  void work();
  /// Writes the remaining changes.
  void finish();

  const ReasonCounts& reasons() const { return node_.reasons(); }
  const mapping::Mapper& mapper() const { return node_.mapper(); }

 private:
  template <class T>
  void post(void (map_store::Node::*handler)(const T&), const T& message) {
    waiting_.push_back([this, handler, message] { (node_.*handler)(message); });
  }

  map_store::Node node_;
  std::deque<std::function<void()>> waiting_;
};

}  // namespace perdure::tools
