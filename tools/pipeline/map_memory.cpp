#include "tools/pipeline/map_memory.h"

#include <utility>

#include "common/base/errors.h"
#include "services/map_store/core/map_copy.h"
#include "services/map_store/core/map_database.h"
#include "services/map_store/core/schema.h"

namespace perdure::tools {
namespace {

map_store::Config withFile(map_store::Config config, const std::filesystem::path& file) {
  config.store_path = file.string();
  return config;
}

}  // namespace

void MapMemory::clear(const std::filesystem::path& file) {
  std::error_code ignored;
  for (const char* part : {"", "-wal", "-shm"}) {
    std::filesystem::remove(file.string() + part, ignored);
  }
}

std::uint64_t MapMemory::newWorld(const std::filesystem::path& map) {
  const auto connection = map_store::openStoreForReading(map.string());
  const auto known = map_store::MapReader(&connection).worlds();
  if (!known) {
    throw StartupError(ExitCode::kUnavailable, "The map " + map.string() + " cannot be read (" +
                                                   known.error().detail + "); give another --map");
  }
  std::uint64_t world = 1;
  while (known->contains(world)) ++world;
  return world;
}

void MapMemory::copy(const std::filesystem::path& from, const std::filesystem::path& file) {
  clear(file);
  map_store::copyMap(from.string(), file.string());
}

MapMemory::MapMemory(map_store::Config config, const std::filesystem::path& file,
                     InstanceId instance, map_store::Outputs outputs)
    : node_(withFile(std::move(config), file), instance, std::move(outputs)) {}

void MapMemory::giveIds(InstanceId filter, const WorldId& session) {
  MapQuery query;
  query.kind = MapQueryKind::kRestore;
  query.client = filter;
  query.world = session;
  query.limit = 1;
  node_.onQuery(query);
}

void MapMemory::onObjects(const Objects& objects) {
  waiting_.push_back([this, objects] {
    node_.onObjects(objects);
    node_.tick(objects.stamp.time.time_since_epoch());
  });
}

void MapMemory::work() {
  for (; !waiting_.empty(); waiting_.pop_front()) waiting_.front()();
}

void MapMemory::finish() {
  work();
  node_.flush();
}

}  // namespace perdure::tools
