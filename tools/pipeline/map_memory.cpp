#include "tools/pipeline/map_memory.h"

#include <utility>

namespace perdure::tools {
namespace {

/// Of an earlier run into the same folder.
void removeMap(const std::filesystem::path& file) {
  std::error_code ignored;
  for (const char* part : {"", "-wal", "-shm"}) {
    std::filesystem::remove(file.string() + part, ignored);
  }
}

map_store::Config emptyMap(map_store::Config config, const std::filesystem::path& file) {
  removeMap(file);
  config.store_path = file.string();
  return config;
}

map_store::Outputs toFilter(Sink<Recalled> recalled) {
  map_store::Outputs outputs;
  outputs.tile = outputs.emptied = [](const MapTile&) {};
  outputs.header = [](const MapHeader&) {};
  outputs.reply = [](const MapReply&) {};
  outputs.recalled = std::move(recalled);
  return outputs;
}

}  // namespace

MapMemory::MapMemory(map_store::Config config, const std::filesystem::path& file,
                     InstanceId instance, Sink<Recalled> recalled)
    : node_(emptyMap(std::move(config), file), instance, toFilter(std::move(recalled))) {}

void MapMemory::onOdometry(const Odometry& odometry) {
  waiting_.push_back([this, odometry] { node_.onOdometry(odometry); });
}

void MapMemory::onObjects(const Objects& objects) {
  waiting_.push_back([this, objects] {
    node_.onObjects(objects);
    node_.tick(objects.stamp.time.time_since_epoch());
  });
}

void MapMemory::onEvent(const Event& event) {
  waiting_.push_back([this, event] { node_.onEvent(event); });
}

void MapMemory::onQuery(const MapQuery& query) {
  waiting_.push_back([this, query] { node_.onQuery(query); });
}

void MapMemory::work() {
  for (; !waiting_.empty(); waiting_.pop_front()) waiting_.front()();
}

void MapMemory::finish() {
  work();
  node_.flush();
}

}  // namespace perdure::tools
