#include "services/map_store/core/schema.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <string>

#include "common/base/errors.h"
#include "services/map_store/core/graph/graph_tables.h"

namespace perdure::map_store {
namespace {

namespace fs = std::filesystem;

// `objects` has one row for each object that was ever confirmed. `gone` is 0, or 1 + the EventKind
// that ended the object; its row then remains as history. core/belief_codec.h encodes `belief`. The
// other columns are for queries. `tile_*` are computed from x, y and meta.tile_size_m.
constexpr char kSchema[] = R"sql(
CREATE TABLE meta(key TEXT PRIMARY KEY, value) WITHOUT ROWID;
CREATE TABLE objects(
  id INTEGER PRIMARY KEY, world INTEGER NOT NULL, epoch INTEGER NOT NULL,
  class TEXT NOT NULL, class_probability REAL NOT NULL, existence REAL NOT NULL,
  x REAL NOT NULL, y REAL NOT NULL, z REAL NOT NULL, yaw REAL NOT NULL,
  length REAL NOT NULL, width REAL NOT NULL, height REAL NOT NULL,
  first_seen_ns INTEGER NOT NULL, last_seen_ns INTEGER NOT NULL, hits INTEGER NOT NULL,
  visibility INTEGER NOT NULL, memory INTEGER NOT NULL,
  tile_x INTEGER NOT NULL, tile_y INTEGER NOT NULL,
  gone INTEGER NOT NULL DEFAULT 0, gone_ns INTEGER, merged_into INTEGER,
  belief BLOB NOT NULL);
CREATE INDEX objects_by_class ON objects(class);
CREATE INDEX objects_by_tile ON objects(tile_x, tile_y);
CREATE VIRTUAL TABLE positions USING rtree(id, x0, x1, y0, y1, z0, z1);
CREATE TABLE working(position INTEGER PRIMARY KEY, id INTEGER NOT NULL, belief BLOB);
)sql";

std::string fixOfUse(const Reason& reason) {
  if (reason.code == "disk_full") return "free space, or raise store.max_size.";
  if (reason.code == "io_error") return "see the disk.";
  if (reason.code == "busy") return "end the other program that writes it.";
  return "set store.path to a file in a folder that this user may write.";
}

[[noreturn]] void cannotUse(const std::string& path, const Reason& reason) {
  throw StartupError(exitCodeOf(reason), "The map " + path + " cannot be used (" + reason.code +
                                             ": " + reason.detail + "); " + fixOfUse(reason));
}

/// Returns whether the file belongs to another program: it begins neither like SQLite nor with
/// zeros.
bool beginsLikeAnotherFile(const std::string& path) {
  static constexpr std::array<char, 16> kMagic = {'S', 'Q', 'L', 'i', 't', 'e', ' ', 'f',
                                                  'o', 'r', 'm', 'a', 't', ' ', '3', '\0'};
  std::ifstream file(path, std::ios::binary);
  std::array<char, 16> head{};
  file.read(head.data(), head.size());
  const auto end = head.begin() + file.gcount();
  return !std::equal(head.begin(), end, kMagic.begin()) &&
         !std::all_of(head.begin(), end, [](char c) { return c == '\0'; });
}

/// Renames the damaged file and returns its new name.
std::string setAside(const std::string& path) {
  int number = 1;
  while (fs::exists(path + ".damaged-" + std::to_string(number))) ++number;
  const std::string aside = path + ".damaged-" + std::to_string(number);
  for (const char* suffix : {"", "-wal", "-shm"}) {
    if (fs::exists(path + suffix)) fs::rename(path + suffix, aside + suffix);
  }
  return aside;
}

constexpr char kOtherPath[] = "set store.path to another file";
constexpr char kGiveMap[] = "give the file that map_store writes (its store.path)";

void refuseForeign(const std::string& path, const Identity& identity, const std::string& fix) {
  if (identity.application != kApplicationId) {
    throw StartupError(ExitCode::kConfiguration, path + " is not a map of Perdure's; " + fix + ".");
  }
  if (identity.version > kSchemaVersion) {
    throw StartupError(ExitCode::kConfiguration,
                       "The map " + path + " has schema " + std::to_string(identity.version) +
                           ", this program knows up to " + std::to_string(kSchemaVersion) +
                           "; use the newer Perdure, or " + fix + ".");
  }
}

void prepareForWriting(const Connection& connection, const StoreOptions& options) {
  // With FULL, a commit is on the disk when it returns, even if the power fails then.
  need(connection.execute(
      "PRAGMA busy_timeout=250; PRAGMA journal_mode=WAL; PRAGMA synchronous=FULL;"
      "PRAGMA journal_size_limit=16777216;"));
  if (options.max_size_mb == 0) return;
  const std::int64_t page = need(connection.integer("PRAGMA page_size"));
  const std::int64_t pages = options.max_size_mb * (1 << 20) / page;
  need(connection.execute("PRAGMA max_page_count=" + std::to_string(pages)));
}

void create(const Connection& connection) {
  auto transaction = need(Transaction::begin(connection));
  need(connection.execute(std::string(kSchema) + kGraphSchema + kAddedSchema +
                          "PRAGMA application_id=" + std::to_string(kApplicationId) +
                          "; PRAGMA user_version=" + std::to_string(kSchemaVersion) + ";"));
  need(transaction.commit());
}

/// Upgrades a file of an older version by adding tables. Makes all changes or none.
void adopt(const Connection& connection, const Identity& identity) {
  if (identity.version == kSchemaVersion) return need(connection.execute(kAddedSchema));
  auto transaction = need(Transaction::begin(connection));
  const std::int64_t version = need(connection.integer("PRAGMA user_version"));
  if (version == kSchemaVersion) return;  // another process has upgraded the file already
  need(connection.execute(std::string(version < kFirstSchemaWithGraph ? kGraphSchema : "") +
                          kAddedSchema + "PRAGMA user_version=" + std::to_string(kSchemaVersion) +
                          ";"));
  need(transaction.commit());
}

/// Fails with a reason if the file is damaged. Throws StartupError if it is not a map of Perdure.
Result<Connection> tryOpen(const StoreOptions& options) {
  return attempt([&] {
    auto connection = need(Connection::open(options.path, Connection::Mode::kReadWriteCreate));
    const Identity identity = need(identityOf(connection));
    if (!identity.empty()) refuseForeign(options.path, identity, kOtherPath);
    if (options.check_at_start) need(wholeFileIsSound(connection));
    prepareForWriting(connection, options);
    identity.empty() ? create(connection) : adopt(connection, identity);
    return connection;
  });
}

void makeFolderOf(const std::string& path) {
  const fs::path folder = fs::absolute(path).parent_path();
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) cannotUse(path, {"cannot_open", folder.string() + ": " + error.message()});
}

}  // namespace

Result<Identity> identityOf(const Connection& connection) {
  return attempt([&] {
    return Identity{need(connection.integer("PRAGMA application_id")),
                    need(connection.integer("PRAGMA user_version")),
                    need(connection.integer("SELECT count(*) FROM sqlite_master"))};
  });
}

Result<void> wholeFileIsSound(const Connection& connection) {
  const auto answer =
      connection.first("PRAGMA quick_check(1)", [](const Statement& row) { return row.text(0); });
  if (!answer) return tl::unexpected<Reason>(answer.error());
  if (*answer == "ok") return {};
  return fail("corrupt", answer->value_or("no answer to the check"));
}

OpenedStore openStore(const StoreOptions& options) {
  makeFolderOf(options.path);
  auto opened = tryOpen(options);
  if (opened) return {std::move(*opened), {}};
  const Reason reason = opened.error();
  if (!isDamage(reason)) cannotUse(options.path, reason);
  if (beginsLikeAnotherFile(options.path)) {
    throw StartupError(ExitCode::kConfiguration,
                       options.path + " is not a database; set store.path to another file.");
  }
  const std::string aside = setAside(options.path);
  opened = tryOpen(options);
  if (!opened) cannotUse(options.path, opened.error());
  return {std::move(*opened),
          "The map was damaged (" + reason.detail + ") and is now " + aside +
              "; a new one was begun. What can be read of the old one: sqlite3 " + aside +
              " .recover"};
}

bool isDamage(const Reason& reason) {
  return reason.code == "corrupt" || reason.code == "not_a_database";
}

void cannotReadMap(const std::string& path, const Reason& reason) {
  const std::string why = " (" + reason.code + ": " + reason.detail + ")";
  if (reason.code == "not_a_database") {
    throw StartupError(ExitCode::kConfiguration,
                       path + " is not a map of Perdure's, or its beginning is damaged" + why +
                           "; " + kGiveMap + ".");
  }
  if (reason.code == "corrupt") {
    throw StartupError(ExitCode::kUnavailable,
                       "The map " + path + " cannot be read: it is damaged" + why +
                           "; give another one. What can be read of it: sqlite3 " + path +
                           " .recover");
  }
  throw StartupError(ExitCode::kUnavailable, "The map " + path + " cannot be read" + why + ".");
}

Connection openStoreForReading(const std::string& path) {
  if (!fs::exists(path)) {
    throw StartupError(ExitCode::kUnavailable, "There is no map " + path + "; " + kGiveMap + ".");
  }
  if (fs::is_directory(path)) {
    throw StartupError(ExitCode::kUnavailable,
                       path + " is a folder; give the map's file in it, such as map.sqlite");
  }
  std::error_code unknown;
  if (fs::file_size(path, unknown) == 0) {
    throw StartupError(ExitCode::kData,
                       path + " is empty (0 bytes) and no map; copy it again, or give another");
  }
  auto connection = Connection::open(path, Connection::Mode::kReadOnly);
  const auto identity = connection.and_then(identityOf);
  if (!identity) cannotReadMap(path, identity.error());
  refuseForeign(path, *identity, kGiveMap);
  return *std::move(connection);
}

}  // namespace perdure::map_store
