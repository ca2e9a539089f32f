#include "services/map_store/fleet/pusher.h"

#include <limits>
#include <utility>

#include "services/map_store/core/belief_codec.h"
#include "services/map_store/core/earth_anchor.h"
#include "services/map_store/core/map_database.h"
#include "services/map_store/fleet/tables.h"

namespace perdure::map_store::fleet {
namespace {

constexpr std::int64_t kSmallest = std::numeric_limits<std::int64_t>::min();
constexpr std::int64_t kLargest = std::numeric_limits<std::int64_t>::max();

constexpr std::int64_t kRowsOfAPortion = 2000;
constexpr char kAttach[] =
    "SELECT number, sent, next_table, next_id FROM "
    "perdure.attach($1::text, $2::text, $3::text, $4::bigint, $5::bigint, $6::float8, $7::float8, "
    "$8::float8, $9::float8)";
constexpr char kAdvance[] =
    "SELECT perdure.advance($1::bigint, $2::text, $3::bigint, $4::bigint, $5::bigint, $6::bigint, "
    "$7::bigint, $8::bigint, $9::bigint)";
constexpr char kSetWorking[] =
    "UPDATE perdure.maps SET revision = $2::bigint, tile_size_m = $3::text, working = $4::bytea, "
    "world = $5::bigint, epoch = $6::bigint WHERE number = $1::bigint";

std::string nameOf(const std::string& what, OutboxTable table) {
  return what + std::to_string(static_cast<std::int64_t>(table));
}

OutboxTable tableAt(std::int64_t number) { return static_cast<OutboxTable>(number); }

void prepareStatements(Link& link) {
  need(link.prepare("advance", kAdvance));
  for (std::int64_t number = 0; number + 1 < kOutboxTables; ++number) {
    const Table& table = tableOf(tableAt(number));
    need(link.prepare(nameOf("put", tableAt(number)), upsertOf(table)));
    need(link.prepare(nameOf("delete", tableAt(number)), "DELETE FROM perdure." + table.name +
                                                             " WHERE map = $1 AND " +
                                                             table.columns.front().name + " = $2"));
  }
  need(link.prepare("set_working", kSetWorking));
  need(link.prepare("clear_working", "DELETE FROM perdure.working WHERE map = $1"));
  need(link.prepare("put_working", upsertOf(workingTable())));
}

/// A read transaction: all reads see one state of the file.
class Snapshot {
 public:
  explicit Snapshot(const Connection& connection) : connection_(connection) {
    need(connection.execute("BEGIN"));
  }
  ~Snapshot() { (void)connection_.execute("ROLLBACK"); }
  Snapshot(const Snapshot&) = delete;
  Snapshot& operator=(const Snapshot&) = delete;

 private:
  const Connection& connection_;
};

/// Returns the position on Earth in the map's file; empty if there is none.
std::vector<double> earthAnchorOf(const Connection& connection) {
  return earthAnchorFrom(MapReader(&connection).earthAnchor().value_or(""));
}

}  // namespace

struct Pusher::Draft {
  std::int64_t most = 0;
  std::uint64_t rows = 0;
  Place next;
  bool whole = false;
};

Pusher::Pusher(std::string file, std::string vehicle, std::vector<double> earth_anchor)
    : file_(std::move(file)),
      vehicle_(std::move(vehicle)),
      earth_anchor_(std::move(earth_anchor)) {}

void Pusher::openFile(bool with_outbox) {
  connection_.reset();
  auto connection = need(Connection::open(file_, Connection::Mode::kReadOnly));
  (void)connection.execute("PRAGMA busy_timeout=1000");
  mark_ = with_outbox ? need(outboxMark(connection)) : OutboxMark();
  has_outbox_ = with_outbox;
  connection_ = std::move(connection);
}

Result<void> Pusher::attach(Link& link) {
  return attempt([&] {
    openFile(true);
    introduce(link);
  });
}

/// Finds or creates the row of this map on the server. If the row is new or of another outbox, the
/// server's map becomes empty.
void Pusher::introduce(Link& link) {
  Values values;
  values.put(std::string_view(vehicle_)).put(std::string_view(mark_.file));
  values.put(std::string_view(mark_.outbox)).put(mark_.acknowledged).put(mark_.last);
  told_earth_ = earth_anchor_.size() == 4 ? earth_anchor_ : earthAnchorOf(*connection_);
  for (std::size_t i = 0; i < 4; ++i) {
    told_earth_.size() == 4 ? values.put(told_earth_[i]) : values.null();
  }
  const auto row = need(link.ask(kAttach, values));
  map_ = row.integer(0, 0);
  at_ = {row.integer(0, 1), row.integer(0, 2), row.integer(0, 3)};
  const auto known = need(link.ask("SELECT 1 FROM pg_prepared_statements WHERE name = 'advance'"));
  if (known.rows() == 0) prepareStatements(link);
}

Result<void> Pusher::replaceAll(Link& link, const std::string& file) {
  return attempt([&] {
    openFile(false);
    mark_ = {file, need(link.ask("SELECT gen_random_uuid()::text")).text(0, 0), 0, 0};
    need(link.run("BEGIN"));
    introduce(link);
    const Snapshot snapshot(*connection_);
    while (at_.next_table < kOutboxTables) (void)pushPortion(link, kRowsOfAPortion, false);
    need(link.run("COMMIT"));
  });
}

Result<bool> Pusher::hasMore() const {
  if (at_.next_table < kOutboxTables) return true;
  const auto newest = connection_->integer("SELECT coalesce(max(number), 0) FROM outbox");
  return newest.map([&](std::int64_t number) { return number > at_.sent; });
}

Result<Portion> Pusher::push(Link& link, std::int64_t most_rows) {
  return attempt([&] {
    if (earth_anchor_.empty() && earthAnchorOf(*connection_) != told_earth_) need(attach(link));
    const Snapshot snapshot(*connection_);
    return pushPortion(link, most_rows, true);
  });
}

Portion Pusher::pushPortion(Link& link, std::int64_t most_rows, bool as_transaction) {
  Draft draft{most_rows, 0, at_, false};
  link.beginBatch(as_transaction);
  const auto read = attempt(
      [&] { at_.next_table < kOutboxTables ? readWhole(link, draft) : readChanges(link, draft); });
  // After an error in reading the file, the empty name of the outbox makes the server refuse the
  // whole portion.
  queueAdvance(link, draft, read.has_value() ? mark_.outbox : "");
  const auto done = link.endBatch();
  need(read);
  need(done);
  at_ = draft.next;
  return {draft.rows, at_.sent, draft.whole};
}

void Pusher::readChanges(Link& link, Draft& draft) const {
  auto entries = need(connection_->prepare(
      "SELECT number, tbl, id FROM outbox WHERE number > ?1 ORDER BY number LIMIT ?2"));
  entries.bind(1, at_.sent).bind(2, draft.most + 1);
  for (;;) {
    draft.whole = !need(entries.step());
    if (draft.whole || draft.rows == static_cast<std::uint64_t>(draft.most)) return;
    queueRow(link, tableAt(entries.integer(1)), entries.integer(2));
    draft.next.sent = entries.integer(0);
    ++draft.rows;
  }
}

void Pusher::queueRow(Link& link, OutboxTable table, std::int64_t id) const {
  if (table == OutboxTable::kWorking) return queueWorking(link);
  const Table& t = tableOf(table);
  const auto row = need(connection_->first(
      selectionOf(t) + " WHERE " + t.columns.front().name + " = ?1",
      [&](const Statement& stored) { return valuesOf(t, map_, stored); }, id));
  link.queue(nameOf(row ? "put" : "delete", table), row.value_or(Values().put(map_).put(id)));
}

void Pusher::queueWorking(Link& link) const {
  auto meta =
      need(connection_->prepare("SELECT (SELECT value FROM meta WHERE key = 'revision'), "
                                "(SELECT value FROM meta WHERE key = 'tile_size_m'), "
                                "(SELECT value FROM meta WHERE key = 'working')"));
  (void)need(meta.step());
  Values values;
  values.put(map_).put(meta.integer(0)).put(std::string_view(meta.text(1)));
  const auto header =
      meta.isNull(2) ? Result<Objects>(fail("belief_malformed")) : decodeHeader(meta.blob(2));
  meta.isNull(2) ? values.null() : values.put(meta.blob(2));
  if (header) {
    values.put(static_cast<std::int64_t>(header->world.world));
    values.put(static_cast<std::int64_t>(header->world.epoch));
  } else {
    values.null().null();
  }
  link.queue("set_working", values);
  link.queue("clear_working", Values().put(map_));
  need(connection_->forRows(selectionOf(workingTable()), [&](const Statement& row) {
    link.queue("put_working", valuesOf(workingTable(), map_, row));
  }));
}

/// Queues the rows of the tables, up to the size of a portion, and the working set at the end.
/// Entries that the outbox received meanwhile are sent afterwards as changes.
void Pusher::readWhole(Link& link, Draft& draft) const {
  while (draft.next.next_table + 1 < kOutboxTables &&
         draft.rows < static_cast<std::uint64_t>(draft.most)) {
    queueRows(link, tableAt(draft.next.next_table), draft);
  }
  if (draft.next.next_table + 1 < kOutboxTables) return;
  queueWorking(link);
  draft.next.next_table = kOutboxTables;
  draft.whole =
      !has_outbox_ ||
      need(connection_->integer("SELECT coalesce(max(number), 0) FROM outbox")) <= draft.next.sent;
}

void Pusher::queueRows(Link& link, OutboxTable table, Draft& draft) const {
  const Table& t = tableOf(table);
  const std::string& key = t.columns.front().name;
  auto rows = need(connection_->prepare(selectionOf(t) + " WHERE " + key + " >= ?1 ORDER BY " +
                                        key + " LIMIT ?2"));
  const auto most = draft.most - static_cast<std::int64_t>(draft.rows);
  rows.bind(1, draft.next.next_id).bind(2, most);
  for (std::int64_t count = 0;; ++count) {
    if (need(rows.step())) {
      link.queue(nameOf("put", table), valuesOf(t, map_, rows));
      ++draft.rows;
      const std::int64_t id = rows.integer(0);
      draft.next.next_id = id == kLargest ? id : id + 1;
      if (id != kLargest) continue;
    } else if (count == most) {
      return;
    }
    ++draft.next.next_table;
    draft.next.next_id = kSmallest;
    return;
  }
}

void Pusher::queueAdvance(Link& link, const Draft& draft, const std::string& outbox) const {
  Values values;
  values.put(map_).put(std::string_view(outbox));
  for (const Place& place : {at_, draft.next}) {
    values.put(place.sent).put(place.next_table).put(place.next_id);
  }
  link.queue("advance", values.put(static_cast<std::int64_t>(draft.whole)));
}

}  // namespace perdure::map_store::fleet
