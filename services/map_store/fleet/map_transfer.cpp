#include "services/map_store/fleet/map_transfer.h"

#include <filesystem>
#include <limits>
#include <optional>
#include <utility>

#include "common/base/errors.h"
#include "services/map_store/core/draft_file.h"
#include "services/map_store/core/map_copy.h"
#include "services/map_store/core/schema.h"
#include "services/map_store/fleet/pusher.h"
#include "services/map_store/fleet/server_schema.h"
#include "services/map_store/fleet/server_url.h"
#include "services/map_store/fleet/tables.h"

namespace perdure::map_store::fleet {
namespace {

namespace fs = std::filesystem;
constexpr int kRowsAtOnce = 2000;
/// Stands for the file's identity of a pushed map, so that each name has one pushed map.
constexpr char kPushed[] = "pushed";

std::string fixOf(const Reason& reason) {
  if (reason.code == "server_login") {
    return "correct user and database in --url, and the password in its passfile";
  }
  if (reason.code == "server_rights") {
    return "let the server's administrator grant the user of --url what it needs";
  }
  if (reason.code == "server_schema") return "use the version of Perdure that the vehicles have";
  if (reason.code == "server_unreachable") {
    return "see that the server runs and that --url leads to it";
  }
  if (reason.code == "server_full") return "free space on the server";
  if (reason.code == "disk_full") return "free space, or name a file on another disk";
  return "see the server's log, and try again";
}

[[noreturn]] void giveUp(const std::string& what, const Reason& reason) {
  throw StartupError(exitCodeOf(reason), what + " (" + reason.code + ": " + reason.detail + "); " +
                                             fixOf(reason) + ".");
}

template <class T>
T orGiveUp(Result<T> result, const std::string& what) {
  if (!result) giveUp(what, result.error());
  if constexpr (!std::is_void_v<T>) return std::move(*result);
}

Link connect(const std::string& url, const Stop& stop) {
  checkUrl(url, "--url");
  return orGiveUp(Link::open(url, {}, stop), "The server cannot be reached");
}

constexpr char kUnread[] = "The server's maps cannot be read";

void refuseWithoutMaps(Link& link) {
  const auto there = orGiveUp(link.ask("SELECT to_regclass('perdure.about') IS NOT NULL"), kUnread);
  if (!there.boolean(0, 0)) {
    throw StartupError(
        ExitCode::kUnavailable,
        "The database has no maps; give the one that is in the vehicles' store.url.");
  }
  const auto version = orGiveUp(link.ask("SELECT max(version) FROM perdure.about"), kUnread);
  if (version.integer(0, 0) == kServerSchema) return;
  giveUp(kUnread, {"server_schema", "they have schema " + std::to_string(version.integer(0, 0)) +
                                        ", this program knows " + std::to_string(kServerSchema)});
}

struct Chosen {
  std::int64_t number = 0, revision = 0;
  std::string tile_size_m;
  std::optional<std::vector<std::uint8_t>> working;
};

Chosen choose(Link& link, const std::string& name, bool unfinished) {
  const auto rows =
      orGiveUp(link.ask("SELECT number, whole, revision, tile_size_m, working FROM perdure.maps "
                        "WHERE vehicle = $1::text ORDER BY changed DESC, number DESC LIMIT 1",
                        Values().put(std::string_view(name))),
               kUnread);
  if (rows.rows() == 0) {
    throw StartupError(ExitCode::kUsage, "The server has no map of the name " + name +
                                             "; `perdure map maps --url …` lists those it has.");
  }
  if (!rows.boolean(0, 1) && !unfinished) {
    throw StartupError(ExitCode::kUnavailable,
                       "The map " + name +
                           " is in the midst of being sent; try again, or take what is there with "
                           "--unfinished.");
  }
  Chosen chosen{rows.integer(0, 0), rows.integer(0, 2), rows.text(0, 3), std::nullopt};
  if (!rows.isNull(0, 4)) {
    const auto bytes = rows.blob(0, 4);
    chosen.working.emplace(bytes.begin(), bytes.end());
  }
  return chosen;
}

/// Copies all rows of one table in portions.
void pullTable(Link& link, std::int64_t map, const Table& table, const Connection& to) {
  const std::string what = "The map cannot be written";
  auto insertion = orGiveUp(to.prepare(insertionOf(table)), what);
  const std::string& key = table.columns.front().name;
  const std::string sql = "SELECT " + columnsOf(table) + " FROM perdure." + table.name +
                          " WHERE map = $1::bigint AND " + key + " >= $2::bigint ORDER BY " + key +
                          " LIMIT " + std::to_string(kRowsAtOnce);
  for (std::int64_t next = std::numeric_limits<std::int64_t>::min();;) {
    const auto rows = orGiveUp(link.ask(sql, Values().put(map).put(next)), kUnread);
    for (int row = 0; row < rows.rows(); ++row) {
      bindRow(table, rows, row, insertion);
      orGiveUp(insertion.run(), what);
    }
    if (rows.rows() < kRowsAtOnce) return;
    const std::int64_t last = rows.integer(kRowsAtOnce - 1, 0);
    if (last == std::numeric_limits<std::int64_t>::max()) return;
    next = last + 1;
  }
}

void pullMeta(const Chosen& chosen, const Connection& to) {
  const std::string what = "The map cannot be written";
  auto put = orGiveUp(to.prepare("REPLACE INTO meta VALUES(?1, ?2)"), what);
  const auto key = [&](std::string_view name) -> Statement& { return put.bind(1, name); };
  orGiveUp(key("revision").bind(2, chosen.revision).run(), what);
  if (!chosen.tile_size_m.empty()) {
    orGiveUp(key("tile_size_m").bind(2, std::string_view(chosen.tile_size_m)).run(), what);
  }
  if (chosen.working) {
    const std::span<const std::uint8_t> bytes(*chosen.working);
    orGiveUp(key("working").bind(2, bytes).run(), what);
  }
}

void pullInto(Link& link, const std::string& name, bool unfinished, const std::string& draft) {
  orGiveUp(link.run("BEGIN ISOLATION LEVEL REPEATABLE READ READ ONLY"), kUnread);
  const Chosen chosen = choose(link, name, unfinished);
  const std::string what = "The map cannot be written";
  const OpenedStore file = openStore({.path = draft});
  auto transaction = orGiveUp(Transaction::begin(file.connection), what);
  for (std::int64_t number = 0; number + 1 < kOutboxTables; ++number) {
    pullTable(link, chosen.number, tableOf(static_cast<OutboxTable>(number)), file.connection);
  }
  pullTable(link, chosen.number, workingTable(), file.connection);
  pullMeta(chosen, file.connection);
  orGiveUp(file.connection.execute("INSERT INTO positions SELECT id, x, x, y, y, z, z FROM objects "
                                   "WHERE gone = 0"),
           what);
  orGiveUp(transaction.commit(), what);
  orGiveUp(link.run("COMMIT"), kUnread);
}

void refuseNameOfVehicle(Link& link, const std::string& name) {
  const auto others = orGiveUp(
      link.ask("SELECT 1 FROM perdure.maps WHERE vehicle = $1::text AND file <> $2::text LIMIT 1",
               Values().put(std::string_view(name)).put(std::string_view(kPushed))),
      kUnread);
  if (others.rows() == 0) return;
  throw StartupError(ExitCode::kUsage, "A vehicle sends its map under the name " + name +
                                           "; choose another one with --name.");
}

}  // namespace

std::vector<ServerMap> listMaps(const std::string& url) {
  const Stop stop;
  Link link = connect(url, stop);
  refuseWithoutMaps(link);
  const auto rows = orGiveUp(
      link.ask("SELECT number, vehicle, file, revision, whole, "
               "to_char(changed AT TIME ZONE 'UTC', 'YYYY-MM-DD\"T\"HH24:MI:SS\"Z\"'), "
               "(SELECT count(*) FROM perdure.objects o WHERE o.map = number AND gone = 0), "
               "(SELECT count(*) FROM perdure.anchors a WHERE a.map = number) "
               "FROM perdure.maps ORDER BY vehicle, maps.changed DESC, number DESC"),
      kUnread);
  std::vector<ServerMap> maps;
  for (int row = 0; row < rows.rows(); ++row) {
    maps.push_back({rows.integer(row, 0), rows.text(row, 1), rows.text(row, 2),
                    rows.integer(row, 3), rows.integer(row, 6), rows.integer(row, 7),
                    rows.boolean(row, 4), rows.text(row, 5)});
  }
  return maps;
}

void pullMap(const std::string& url, const std::string& name, const std::string& to,
             bool unfinished) {
  if (fs::exists(fs::symlink_status(to))) {
    throw StartupError(ExitCode::kConfiguration,
                       to + " is there already and is not overwritten; remove it, or name another "
                            "file for the map.");
  }
  const Stop stop;
  Link link = connect(url, stop);
  refuseWithoutMaps(link);
  const DraftFile draft(to + ".pulled");  // copyMap uses the draft of `to`
  pullInto(link, name, unfinished, draft.path());
  copyMap(draft.path(), to);
}

std::vector<std::string> pullVehicles(const std::string& url, const std::string& folder,
                                      bool unfinished) {
  std::vector<std::string> files;
  std::string last;  // name of the last map; the newest map of each name comes first
  for (const ServerMap& map : listMaps(url)) {
    const bool wanted = map.file != kPushed && map.vehicle != last && (map.whole || unfinished);
    if (map.file != kPushed) last = map.vehicle;
    if (!wanted) continue;
    checkName(map.vehicle, "The name of map " + std::to_string(map.number) + " on the server");
    files.push_back((fs::path(folder) / (map.vehicle + ".sqlite")).string());
    pullMap(url, map.vehicle, files.back(), unfinished);
  }
  return files;
}

void pushMap(const std::string& from, const std::string& url, const std::string& name,
             const std::vector<double>& earth_anchor) {
  checkName(name, "--name");
  checkEarthAnchor(earth_anchor, "--earth-anchor");
  const Stop stop;
  const Connection file = openStoreForReading(from);
  if (const auto identity = identityOf(file); !identity || identity->version < kSchemaVersion) {
    throw StartupError(ExitCode::kUsage, "The map " + from +
                                             " is of an older version of Perdure; let map_store of "
                                             "this version open a copy of it, and give that.");
  }
  Link link = connect(url, stop);
  (void)orGiveUp(prepareServer(link), "The server cannot be used");
  refuseNameOfVehicle(link, name);
  Pusher pusher(from, name, earth_anchor);
  orGiveUp(pusher.replaceAll(link, kPushed), "The map cannot be sent");
}

}  // namespace perdure::map_store::fleet
