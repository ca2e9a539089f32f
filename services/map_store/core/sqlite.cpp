#include "services/map_store/core/sqlite.h"

#include <sqlite3.h>

#include <string>

#include "common/base/check.h"
#include "common/base/files/sqlite_file.h"

namespace perdure::map_store {
namespace {

tl::unexpected<Reason> failure(int code, sqlite3* connection) {
  return tl::unexpected<Reason>(reasonOf(code, sqliteError(connection, code)));
}

void mustBind(int code) { check(code == SQLITE_OK, "a value is bound to a parameter that exists"); }

}  // namespace

Reason reasonOf(int code, std::string_view detail) {
  const char* word = "database_error";
  switch (code & 0xff) {
    case SQLITE_FULL:
      word = "disk_full";
      break;
    case SQLITE_READONLY:
      word = "read_only";
      break;
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
      word = "busy";
      break;
    case SQLITE_CORRUPT:
      word = "corrupt";
      break;
    case SQLITE_NOTADB:
      word = "not_a_database";
      break;
    case SQLITE_CANTOPEN:
      word = "cannot_open";
      break;
    case SQLITE_IOERR:
      word = "io_error";
      break;
    case SQLITE_CONSTRAINT:
      word = "constraint";
      break;
    default:
      break;
  }
  return {word, std::string(detail)};
}

ExitCode exitCodeOf(const Reason& reason) {
  const bool writing = reason.code == "disk_full" || reason.code == "io_error";
  return writing ? ExitCode::kInputOutput : ExitCode::kUnavailable;
}

void Statement::Finalize::operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }

Statement& Statement::bindInteger(int index, std::int64_t value) {
  mustBind(sqlite3_bind_int64(statement_.get(), index, value));
  return *this;
}

Statement& Statement::bind(int index, double value) {
  mustBind(sqlite3_bind_double(statement_.get(), index, value));
  return *this;
}

Statement& Statement::bind(int index, std::string_view value) {
  mustBind(sqlite3_bind_text(statement_.get(), index, value.data(), static_cast<int>(value.size()),
                             SQLITE_TRANSIENT));
  return *this;
}

Statement& Statement::bind(int index, std::span<const std::uint8_t> value) {
  mustBind(sqlite3_bind_blob(statement_.get(), index, value.data(), static_cast<int>(value.size()),
                             SQLITE_TRANSIENT));
  return *this;
}

Statement& Statement::bindNull(int index) {
  mustBind(sqlite3_bind_null(statement_.get(), index));
  return *this;
}

Result<bool> Statement::step() {
  const int code = sqlite3_step(statement_.get());
  if (code == SQLITE_ROW) return true;
  sqlite3* connection = sqlite3_db_handle(statement_.get());
  if (code == SQLITE_DONE) {
    reset();
    return false;
  }
  auto error = failure(code, connection);
  reset();
  return error;
}

void Statement::reset() {
  sqlite3_reset(statement_.get());
  sqlite3_clear_bindings(statement_.get());
}

std::int64_t Statement::integer(int column) const {
  return sqlite3_column_int64(statement_.get(), column);
}

double Statement::real(int column) const { return sqlite3_column_double(statement_.get(), column); }

std::string Statement::text(int column) const {
  const auto* bytes = sqlite3_column_text(statement_.get(), column);
  return bytes == nullptr ? std::string() : std::string(reinterpret_cast<const char*>(bytes));
}

std::span<const std::uint8_t> Statement::blob(int column) const {
  const auto* bytes =
      static_cast<const std::uint8_t*>(sqlite3_column_blob(statement_.get(), column));
  return {bytes, static_cast<std::size_t>(sqlite3_column_bytes(statement_.get(), column))};
}

bool Statement::isNull(int column) const {
  return sqlite3_column_type(statement_.get(), column) == SQLITE_NULL;
}

bool Statement::isNumber(int column) const {
  const int type = sqlite3_column_type(statement_.get(), column);
  return type == SQLITE_FLOAT || type == SQLITE_INTEGER;
}

void Connection::Close::operator()(sqlite3* connection) const { sqlite3_close_v2(connection); }

Result<Connection> Connection::open(const std::string& path, Mode mode) {
  if (mode == Mode::kReadOnly) {
    const OpenedSqlite opened = openSqliteToRead(path);
    Connection connection(opened.connection);
    if (opened.code != SQLITE_OK) return tl::unexpected(reasonOf(opened.code, opened.why));
    return connection;
  }
  sqlite3* raw = nullptr;
  const int code =
      sqlite3_open_v2(path.c_str(), &raw,
                      SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE | SQLITE_OPEN_NOMUTEX, nullptr);
  Connection connection(raw);
  if (code != SQLITE_OK) return failure(code, raw);
  sqlite3_extended_result_codes(raw, 1);
  return connection;
}

Result<Statement> Connection::prepare(std::string_view sql) const {
  sqlite3_stmt* statement = nullptr;
  const int code = sqlite3_prepare_v2(connection_.get(), sql.data(), static_cast<int>(sql.size()),
                                      &statement, nullptr);
  if (code != SQLITE_OK) return failure(code, connection_.get());
  return Statement(statement);
}

Result<void> Connection::execute(const std::string& sql) const {
  const int code = sqlite3_exec(connection_.get(), sql.c_str(), nullptr, nullptr, nullptr);
  if (code != SQLITE_OK) return failure(code, connection_.get());
  return {};
}

Result<std::int64_t> Connection::integer(std::string_view sql) const {
  return first(sql, [](const Statement& row) { return row.integer(0); })
      .and_then([](std::optional<std::int64_t> value) -> Result<std::int64_t> {
        if (!value) return fail("database_error", "a query that must have one row has none");
        return *value;
      });
}

Result<bool> Connection::has(const std::string& name) const {
  return integer("SELECT count(*) FROM sqlite_master WHERE name = '" + name + "'")
      .map([](std::int64_t count) { return count > 0; });
}

Result<void> Connection::copyInto(const Connection& target) const {
  constexpr int kAllPages = -1;
  sqlite3* to = target.connection_.get();
  sqlite3_backup* backup = sqlite3_backup_init(to, "main", connection_.get(), "main");
  if (backup == nullptr) return failure(sqlite3_errcode(to), to);
  const int stepped = sqlite3_backup_step(backup, kAllPages);
  const int finished = sqlite3_backup_finish(backup);
  if (stepped == SQLITE_DONE && finished == SQLITE_OK) return {};
  return failure(stepped == SQLITE_DONE ? finished : stepped, to);
}

Result<Transaction> Transaction::begin(const Connection& connection) {
  return connection.execute("BEGIN IMMEDIATE").map([&] { return Transaction(&connection); });
}

Transaction::~Transaction() {
  if (connection_ != nullptr) (void)connection_->execute("ROLLBACK");
}

Result<void> Transaction::commit() {
  const auto committed = connection_->execute("COMMIT");
  if (committed) connection_ = nullptr;
  return committed;
}

}  // namespace perdure::map_store
