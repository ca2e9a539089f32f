#include "services/map_store/core/outbox.h"

#include <array>
#include <string_view>

namespace perdure::map_store {
namespace {

struct Followed {
  OutboxTable number;
  const char* name;
  const char* key;
};
constexpr std::array kFollowed = {Followed{OutboxTable::kClasses, "graph_classes", "number"},
                                  Followed{OutboxTable::kAnchors, "anchors", "id"},
                                  Followed{OutboxTable::kPoses, "anchor_poses", "id"},
                                  Followed{OutboxTable::kEdges, "edges", "id"},
                                  Followed{OutboxTable::kObjects, "objects", "id"},
                                  Followed{OutboxTable::kSightings, "sightings", "id"},
                                  Followed{OutboxTable::kViews, "views", "anchor"}};

/// Each row has one entry, with the number of its last change.
std::string enter(OutboxTable table, const std::string& id) {
  const std::string number = std::to_string(static_cast<std::int64_t>(table));
  return "BEGIN DELETE FROM outbox WHERE tbl = " + number + " AND id = " + id +
         "; INSERT INTO outbox(tbl, id) VALUES(" + number + ", " + id + "); END;";
}

/// REPLACE fires a trigger for the row that it inserts, but not for the row that it deletes.
std::string triggersOf(const Followed& table) {
  const std::string name = table.name, key = table.key;
  std::string sql;
  for (const std::string_view event : {"INSERT", "UPDATE", "DELETE"}) {
    const std::string row = event == "DELETE" ? "OLD." : "NEW.";
    sql += "CREATE TRIGGER outbox_" + name + "_" + std::string(event) + " AFTER " +
           std::string(event) + " ON " + name + " " + enter(table.number, row + key);
  }
  return sql;
}

std::string schema() {
  std::string sql =
      "CREATE TABLE outbox(number INTEGER PRIMARY KEY AUTOINCREMENT, tbl INTEGER NOT NULL, "
      "id INTEGER NOT NULL, UNIQUE(tbl, id));";
  for (const Followed& table : kFollowed) sql += triggersOf(table);
  for (const std::string_view event : {"INSERT", "UPDATE"}) {
    sql += "CREATE TRIGGER outbox_meta_" + std::string(event) + " AFTER " + std::string(event) +
           " ON meta WHEN NEW.key IN ('working', 'revision', 'tile_size_m') " +
           enter(OutboxTable::kWorking, "0");
  }
  return sql +
         "INSERT OR IGNORE INTO meta VALUES('file', lower(hex(randomblob(16))));"
         "REPLACE INTO meta VALUES('outbox', lower(hex(randomblob(16))));"
         "REPLACE INTO meta VALUES('outbox_acknowledged', 0);";
}

std::string removal() {
  std::string sql =
      "DROP TABLE IF EXISTS outbox; DROP TRIGGER IF EXISTS outbox_meta_INSERT;"
      "DROP TRIGGER IF EXISTS outbox_meta_UPDATE;";
  for (const Followed& table : kFollowed) {
    for (const char* event : {"INSERT", "UPDATE", "DELETE"}) {
      sql += std::string("DROP TRIGGER IF EXISTS outbox_") + table.name + "_" + event + ";";
    }
  }
  return sql;
}

Result<std::string> text(const Connection& connection, std::string_view sql) {
  return connection.first(sql, [](const Statement& row) { return row.text(0); }).map([](auto text) {
    return std::move(text).value_or("");
  });
}

}  // namespace

Result<void> openOutbox(const Connection& connection) {
  auto transaction = Transaction::begin(connection);
  if (!transaction) return tl::unexpected<Reason>(transaction.error());
  const auto follows_all = connection.has("outbox_views_INSERT");
  if (!follows_all) return tl::unexpected<Reason>(follows_all.error());
  if (*follows_all) return {};
  const auto made = connection.execute(removal() + schema());
  return made ? transaction->commit() : made;
}

Result<void> dropOutbox(const Connection& connection) {
  const auto there = connection.has("outbox");
  if (!there) return tl::unexpected<Reason>(there.error());
  if (!*there) return {};
  auto transaction = Transaction::begin(connection);
  if (!transaction) return tl::unexpected<Reason>(transaction.error());
  const auto dropped = connection.execute(removal());
  return dropped ? transaction->commit() : dropped;
}

Result<void> acknowledge(const Connection& connection, std::int64_t number) {
  for (const char* sql :
       {"DELETE FROM outbox WHERE number <= ?1",
        "UPDATE meta SET value = ?1 WHERE key = 'outbox_acknowledged' AND value < ?1"}) {
    const auto done = connection.run(sql, number);
    if (!done) return done;
  }
  return {};
}

Result<OutboxMark> outboxMark(const Connection& connection) {
  const auto there = connection.has("outbox");
  if (!there) return tl::unexpected<Reason>(there.error());
  if (!*there) return fail("no_outbox", "the map's file has no outbox");
  const auto file = text(connection, "SELECT value FROM meta WHERE key = 'file'");
  const auto outbox = text(connection, "SELECT value FROM meta WHERE key = 'outbox'");
  const auto acknowledged =
      connection.integer("SELECT value FROM meta WHERE key = 'outbox_acknowledged'");
  const auto last =
      connection.integer("SELECT coalesce(max(seq), 0) FROM sqlite_sequence WHERE name = 'outbox'");
  if (!file) return tl::unexpected<Reason>(file.error());
  if (!outbox) return tl::unexpected<Reason>(outbox.error());
  if (!acknowledged) return tl::unexpected<Reason>(acknowledged.error());
  if (!last) return tl::unexpected<Reason>(last.error());
  return OutboxMark{*file, *outbox, *acknowledged, *last};
}

}  // namespace perdure::map_store
