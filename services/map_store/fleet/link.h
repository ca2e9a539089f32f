// A connection to PostgreSQL whose waits have time limits. It wraps non-blocking libpq (RAII).
#pragma once

#include <sys/eventfd.h>
#include <unistd.h>

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/check.h"
#include "common/base/result.h"

struct pg_conn;
struct pg_result;

namespace perdure::map_store::fleet {

/// A signal that ends all waits of another thread.
class Stop {
 public:
  Stop() : file_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
    perdure::check(file_ >= 0, "a process has a file descriptor left");
  }
  ~Stop() { close(file_); }
  Stop(const Stop&) = delete;
  Stop& operator=(const Stop&) = delete;
  /// Ends all present and future waits. May be called from any thread; cannot be undone.
  void raise() const {
    const std::uint64_t one = 1;
    (void)!write(file_, &one, sizeof one);
  }
  int file() const { return file_; }  ///< file descriptor that becomes readable after raise()

 private:
  int file_;
};

/// Time limits of waits. Name resolution has the limits of the system's resolver instead.
struct Patience {
  std::chrono::milliseconds connect{10'000};
  std::chrono::milliseconds answer{20'000};  ///< longest time in which nothing is sent or received
};

/// Parameters of a statement, in order.
class Values {
 public:
  Values& put(std::int64_t value);
  Values& put(double value);
  /// Replaces bytes that are zero or not UTF-8 by "?", because the server would refuse them.
  Values& put(std::string_view value);
  Values& put(std::span<const std::uint8_t> value);
  Values& null();

 private:
  friend class Link;
  std::vector<std::optional<std::string>> bytes_;
};

/// The rows that the server returned.
class Answer {
 public:
  explicit Answer(pg_result* result) : result_(result) {}
  int rows() const;
  std::int64_t integer(int row, int column) const;  ///< the value of a bigint column
  double real(int row, int column) const;           ///< the value of a float8 column
  bool boolean(int row, int column) const;
  std::string text(int row, int column) const;
  std::span<const std::uint8_t> blob(int row, int column) const;
  bool isNull(int row, int column) const;

 private:
  struct Clear {
    void operator()(pg_result* result) const;
  };
  std::unique_ptr<pg_result, Clear> result_;
};

/// A link to the server. Its functions fail with "server_unreachable" (no connection, no answer, or
/// a lost connection), "server_login" (name, password or database), "server_rights", "server_full",
/// "server_busy", "server_overtaken" (another process has written this map meanwhile), "stopped",
/// or "server_refused" (all others). After "server_unreachable" or "stopped" the link cannot be
/// used any more.
class Link {
 public:
  /// Connects to the server. `stop` must outlive the link; stop.raise() ends every wait.
  static Result<Link> open(const std::string& url, const Patience& patience, const Stop& stop);

  /// Runs one statement and returns its rows.
  Result<Answer> ask(const std::string& sql, const Values& values = {});
  /// Runs statements without parameters or answers in one transaction.
  Result<void> run(const std::string& sql);
  Result<void> prepare(const std::string& name, const std::string& sql);

  /// Begins a batch of statements: call queue() for each, then endBatch(). The batch is one
  /// transaction; if `as_transaction` is false, it is a part of the caller's transaction.
  void beginBatch(bool as_transaction = true);
  void queue(const std::string& prepared, const Values& values);
  /// Sends the batch and waits for its results. After success the transaction is committed; after
  /// "server_unreachable" it may or may not be.
  Result<void> endBatch();

  /// Waits for a notification. Returns its payload, or nothing after the time limit.
  Result<std::optional<std::string>> notification(std::chrono::milliseconds patience);

 private:
  struct Close {
    void operator()(pg_conn* connection) const;
  };
  Link(pg_conn* connection, const Patience& patience, const Stop& stop)
      : connection_(connection), patience_(patience), stop_(&stop) {}
  Result<void> finishConnecting();
  Result<void> setUp();
  Result<void> wait(short events, std::chrono::steady_clock::time_point until) const;
  void queueCommand(const char* sql);
  Result<pg_result*> next();
  Result<Answer> last();
  Reason lost() const;

  std::unique_ptr<pg_conn, Close> connection_;
  Patience patience_;
  const Stop* stop_;
  bool unsent_ = false, as_transaction_ = true;
};

}  // namespace perdure::map_store::fleet
