// RAII wrappers for SQLite: connection, prepared statements, transaction.
#pragma once

#include <cstdint>
#include <exception>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

#include "common/base/errors.h"
#include "common/base/result.h"
#include "common/base/time.h"

struct sqlite3;
struct sqlite3_stmt;

namespace perdure::map_store {

/// Returns the reason for a result code of SQLite: "disk_full", "read_only", "busy", "corrupt",
/// "not_a_database", "cannot_open", "io_error", "constraint" or "database_error".
Reason reasonOf(int code, std::string_view detail);

/// Returns the exit status of a program that ends with this reason: 74 for a failed write, else 69.
ExitCode exitCodeOf(const Reason& reason);

/// An exception within a module. attempt() converts it to a result at the module's edge.
struct Failed : std::exception {
  explicit Failed(Reason why) : reason(std::move(why)) {}
  const char* what() const noexcept override { return reason.detail.c_str(); }
  Reason reason;
};

/// Returns the value. Throws Failed with the reason if there is none.
template <class T>
T need(Result<T> result) {
  if (!result) throw Failed(std::move(result).error());
  if constexpr (!std::is_void_v<T>) return *std::move(result);
}

/// Calls `run`. Returns its result, or the reason if it throws Failed.
template <class Run>
Result<std::invoke_result_t<Run>> attempt(Run run) {
  try {
    if constexpr (std::is_void_v<std::invoke_result_t<Run>>) {
      run();
      return {};
    } else {
      return run();
    }
  } catch (Failed& failed) {
    return tl::unexpected<Reason>(std::move(failed.reason));
  }
}

/// A prepared statement. Its connection must outlive it. Parameters count from 1, columns from 0.
class Statement {
 public:
  Statement() = default;

  /// Binds an integer, flag or enumeration. An unsigned value is stored as the same 64 bits.
  template <class T>
  requires(std::is_integral_v<T> || std::is_enum_v<T>) Statement& bind(int index, T value) {
    return bindInteger(index, static_cast<std::int64_t>(value));
  }
  Statement& bind(int index, TimePoint value) { return bind(index, toNanoseconds(value)); }
  Statement& bind(int index, double value);
  Statement& bind(int index, std::string_view value);
  Statement& bind(int index, std::span<const std::uint8_t> value);
  Statement& bindNull(int index);
  Statement& bindAll(const auto&... values) {
    int index = 0;
    (bind(++index, values), ...);
    return *this;
  }

  /// Returns true if a row was read. Returns false at the end; the statement is then reset.
  Result<bool> step();
  /// Runs the statement to its end, resets it and clears its bindings.
  Result<void> run() {
    return forEach([](const Statement&) {});
  }
  Result<void> forEach(auto take) {
    for (;;) {
      const auto row = step();
      if (!row) return tl::unexpected<Reason>(row.error());
      if (!*row) return {};
      take(std::as_const(*this));
    }
  }
  void reset();

  std::int64_t integer(int column) const;
  std::uint64_t id(int column) const { return static_cast<std::uint64_t>(integer(column)); }
  double real(int column) const;
  std::string text(int column) const;
  /// The bytes of a blob, valid until the next step or reset.
  std::span<const std::uint8_t> blob(int column) const;
  bool isNull(int column) const;
  bool isNumber(int column) const;

 private:
  friend class Connection;
  struct Finalize {
    void operator()(sqlite3_stmt* statement) const;
  };
  explicit Statement(sqlite3_stmt* statement) : statement_(statement) {}
  Statement& bindInteger(int index, std::int64_t value);
  std::unique_ptr<sqlite3_stmt, Finalize> statement_;
};

class Connection {
 public:
  enum class Mode { kReadWriteCreate, kReadOnly };
  static Result<Connection> open(const std::string& path, Mode mode);

  Result<Statement> prepare(std::string_view sql) const;
  Result<void> run(std::string_view sql, const auto&... values) const {
    return prepare(sql).and_then(
        [&](Statement statement) { return statement.bindAll(values...).run(); });
  }
  Result<void> forRows(std::string_view sql, auto take, const auto&... values) const {
    return prepare(sql).and_then(
        [&](Statement rows) { return rows.bindAll(values...).forEach(take); });
  }
  /// Returns the result of `read` for the first row, or nothing if there is no row.
  template <class Read, class T = std::invoke_result_t<Read, const Statement&>>
  Result<std::optional<T>> first(std::string_view sql, Read read, const auto&... values) const {
    return prepare(sql).and_then([&](Statement row) -> Result<std::optional<T>> {
      return row.bindAll(values...).step().map([&](bool there) {
        return there ? std::optional<T>(read(std::as_const(row))) : std::nullopt;
      });
    });
  }
  /// Runs one or several statements that have no results, separated by semicolons.
  Result<void> execute(const std::string& sql) const;
  /// Returns the first column of the first row. The query must return a row.
  Result<std::int64_t> integer(std::string_view sql) const;
  /// Whether the file has a table or trigger with this name.
  Result<bool> has(const std::string& name) const;
  /// Copies one state of this database to `target`, even while other processes write to this one.
  Result<void> copyInto(const Connection& target) const;

 private:
  struct Close {
    void operator()(sqlite3* connection) const;
  };
  explicit Connection(sqlite3* connection) : connection_(connection) {}
  std::unique_ptr<sqlite3, Close> connection_;
};

/// Calls `read` as attempt() does. All its queries read one state of the file, because they run in
/// a savepoint.
template <class Read>
Result<std::invoke_result_t<Read>> inOneState(const Connection& connection, Read read) {
  if (auto begun = connection.execute("SAVEPOINT state"); !begun) {
    return tl::unexpected<Reason>(std::move(begun).error());
  }
  auto value = attempt(read);
  auto released = connection.execute("RELEASE state");
  if (value && !released) return tl::unexpected<Reason>(std::move(released).error());
  return value;
}

/// A transaction. The destructor rolls it back unless it was committed.
class Transaction {
 public:
  static Result<Transaction> begin(const Connection& connection);
  ~Transaction();
  Transaction(Transaction&& other) noexcept : connection_(other.connection_) {
    other.connection_ = nullptr;
  }
  Transaction& operator=(Transaction&&) = delete;
  Result<void> commit();

 private:
  explicit Transaction(const Connection* connection) : connection_(connection) {}
  const Connection* connection_;
};

}  // namespace perdure::map_store
