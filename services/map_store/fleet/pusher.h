// Sends what changed in a map's file to the server, in portions that are each one transaction
// there: rows as they are now, in the order of their last change. The server says up to where it
// has come, so that a portion whose answer was lost is neither sent again nor left out. A map that
// the server does not have, or has missed changes of, is sent whole.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "services/map_store/core/outbox.h"
#include "services/map_store/core/sqlite.h"
#include "services/map_store/fleet/link.h"

namespace perdure::map_store::fleet {

struct Portion {
  std::uint64_t rows = 0;
  std::int64_t sent = 0;  ///< entries of the outbox up to this one are on the server
  bool whole = false;     ///< the server has all of a state that the file had
};

class Pusher {
 public:
  /// `earth_anchor`: four numbers (parameters.h), or empty: as the file knows it. The file is
  /// opened for reading only.
  Pusher(std::string file, std::string vehicle, std::vector<double> earth_anchor);

  /// Asks the server where it stands. Before the first push of each link, and after a push that
  /// failed with any reason.
  Result<void> attach(Link& link);
  /// Sends at most so many rows; fewer, and whole, where there are no more.
  Result<Portion> push(Link& link, std::int64_t most_rows);
  /// Instead of attach and push, for a file without outbox: makes the map of this vehicle and
  /// `file` what the file holds, in one transaction.
  Result<void> replaceAll(Link& link, const std::string& file);
  /// Whether the file has what was not sent.
  Result<bool> hasMore() const;

  std::int64_t sent() const { return at_.sent; }
  std::int64_t number() const { return map_; }  ///< of the map, on the server

 private:
  struct Place {
    std::int64_t sent = 0, next_table = kOutboxTables, next_id = 0;
  };
  struct Draft;  ///< a portion that is being put together
  Result<void> openFile(bool with_outbox);
  Result<void> introduce(Link& link);
  Result<void> readChanges(Link& link, Draft& draft) const;
  Result<void> readWhole(Link& link, Draft& draft) const;
  Result<void> queueRow(Link& link, OutboxTable table, std::int64_t id) const;
  Result<void> queueWorking(Link& link) const;
  Result<void> queueRows(Link& link, OutboxTable table, Draft& draft) const;
  Result<Portion> pushPortion(Link& link, std::int64_t most_rows, bool as_transaction);
  void queueAdvance(Link& link, const Draft& draft, const std::string& outbox) const;

  const std::string file_, vehicle_;
  const std::vector<double> earth_anchor_;
  std::vector<double> told_earth_;  ///< what the server was told, that or the file's own
  std::optional<Connection> connection_;
  OutboxMark mark_;
  bool has_outbox_ = true;
  std::int64_t map_ = 0;
  Place at_;
};

}  // namespace perdure::map_store::fleet
