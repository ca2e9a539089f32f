#include "tools/map/correct_file.h"

#include "common/base/errors.h"
#include "common/base/ids.h"
#include "services/map_store/node.h"

namespace perdure::tools {
namespace {

/// Returns the size of the file's tiles.
double checkUsable(const std::string& path) {
  (void)map_store::openStoreForReading(path);
  using map_store::Connection;
  const auto connection = Connection::open(path, Connection::Mode::kReadWriteCreate);
  if (!connection) map_store::cannotReadMap(path, connection.error());
  if (const auto sound = map_store::wholeFileIsSound(*connection); !sound) {
    map_store::cannotReadMap(path, sound.error());
  }
  if (connection->has("outbox").value_or(false)) {
    throw StartupError(ExitCode::kUsage,
                       "{} is sent to a server: start its map_store, and leave out --db or --map",
                       path);
  }
  const auto size = connection->first("SELECT value FROM meta WHERE key = 'tile_size_m'",
                                      [](const map_store::Statement& row) { return row.real(0); });
  const auto alone = connection->execute("PRAGMA locking_mode=EXCLUSIVE; BEGIN IMMEDIATE; COMMIT");
  if (alone)
    return size ? size->value_or(map_store::Config().tile_size_m) : map_store::Config().tile_size_m;
  if (alone.error().code != "busy") map_store::cannotReadMap(path, alone.error());
  throw StartupError(ExitCode::kUnavailable,
                     "{} is in use by another program; leave out --db or --map to send the "
                     "correction to the running map_store, or stop it",
                     path);
}

}  // namespace

MapReply correctFile(const std::string& path, const Correction& correction) {
  map_store::Config config;
  config.tile_size_m = checkUsable(path);
  config.store_path = path;
  config.check_at_start = false;  // it would rename a damaged file
  MapReply answer;
  map_store::Node node(config, makeInstanceId(),
                       {.tile = [](const MapTile&) {},
                        .emptied = [](const MapTile&) {},
                        .header = [](const MapHeader&) {},
                        .reply = [&](const MapReply& reply) { answer = reply; },
                        .near = [](const MapNear&) {}});
  node.onCorrection({1, 1, correction});
  return answer;
}

}  // namespace perdure::tools
