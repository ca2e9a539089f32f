// A connection to PostgreSQL that never waits longer than it is told to: libpq behind RAII, without
// blocking, values by their bits.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"
#include "services/map_store/fleet/stop.h"

struct pg_conn;
struct pg_result;

namespace perdure::map_store::fleet {

/// How long is waited. A name server's answer is waited for as the system's resolver does.
struct Patience {
  std::chrono::milliseconds connect{10'000};
  std::chrono::milliseconds answer{20'000};  ///< while nothing is sent or received
};

/// Parameters of one statement, in their order.
class Values {
 public:
  Values& put(std::int64_t value);
  Values& put(double value);
  /// What is not UTF-8, or zero, becomes "?": the server would refuse it.
  Values& put(std::string_view value);
  Values& put(std::span<const std::uint8_t> value);
  Values& null();

 private:
  friend class Link;
  std::vector<std::optional<std::string>> bytes_;
};

/// What a statement returned.
class Answer {
 public:
  explicit Answer(pg_result* result) : result_(result) {}
  int rows() const;
  std::int64_t integer(int row, int column) const;  ///< of bigint
  double real(int row, int column) const;           ///< of float8
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

/// Reasons: "server_unreachable" (no connection, no answer, or it was lost), "server_login" (name,
/// password or database), "server_rights", "server_full", "server_busy", "server_refused" (any
/// other), "server_overtaken" (another process has written this map meanwhile), "stopped". After
/// "server_unreachable" and "stopped" the link is of no more use.
class Link {
 public:
  /// `stop` must outlive the link; once it is raised every wait ends.
  static Result<Link> open(const std::string& url, const Patience& patience, const Stop& stop);

  /// One statement; its answer.
  Result<Answer> ask(const std::string& sql, const Values& values = {});
  /// Statements without parameters or answers, in one transaction.
  Result<void> run(const std::string& sql);
  Result<void> prepare(const std::string& name, const std::string& sql);

  /// Statements that are sent together: begun, queued, then done. They are one transaction, or part
  /// of the one that is open.
  void beginBatch(bool as_transaction = true);
  void queue(const std::string& prepared, const Values& values);
  /// Committed (as a transaction) when it returns without a reason. With "server_unreachable" it is
  /// not known.
  Result<void> endBatch();

  /// Waits for a notification: its payload, or nothing where none came in time.
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
