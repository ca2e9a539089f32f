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

/// Returns the body of a trigger that enters a changed row. Each row has one entry, with the number
/// of its last change.
std::string enter(OutboxTable table, const std::string& id) {
  const std::string number = std::to_string(static_cast<std::int64_t>(table));
  return "BEGIN DELETE FROM outbox WHERE tbl = " + number + " AND id = " + id +
         "; INSERT INTO outbox(tbl, id) VALUES(" + number + ", " + id + "); END;";
}

/// Returns the triggers of a table. REPLACE fires one for the row that it inserts, but not for the
/// row that it deletes.
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

std::string text(const Connection& connection, std::string_view sql) {
  return need(connection.first(sql, [](const Statement& row) { return row.text(0); })).value_or("");
}

}  // namespace

void openOutbox(const Connection& connection) {
  auto transaction = need(Transaction::begin(connection));
  if (need(connection.has("outbox_views_INSERT"))) return;  // it follows all tables
  need(connection.execute(removal() + schema()));
  need(transaction.commit());
}

void dropOutbox(const Connection& connection) {
  if (!need(connection.has("outbox"))) return;
  auto transaction = need(Transaction::begin(connection));
  need(connection.execute(removal()));
  need(transaction.commit());
}

void acknowledge(const Connection& connection, std::int64_t number) {
  for (const char* sql :
       {"DELETE FROM outbox WHERE number <= ?1",
        "UPDATE meta SET value = ?1 WHERE key = 'outbox_acknowledged' AND value < ?1"}) {
    need(connection.run(sql, number));
  }
}

Result<OutboxMark> outboxMark(const Connection& connection) {
  return attempt([&] {
    if (!need(connection.has("outbox"))) {
      throw Failed{{"no_outbox", "the map's file has no outbox"}};
    }
    return OutboxMark{
        text(connection, "SELECT value FROM meta WHERE key = 'file'"),
        text(connection, "SELECT value FROM meta WHERE key = 'outbox'"),
        need(connection.integer("SELECT value FROM meta WHERE key = 'outbox_acknowledged'")),
        need(connection.integer(
            "SELECT coalesce(max(seq), 0) FROM sqlite_sequence WHERE name = 'outbox'"))};
  });
}

}  // namespace perdure::map_store
