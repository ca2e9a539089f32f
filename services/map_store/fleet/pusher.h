// Sends the changes in a map's file to the server in portions of one transaction each: the current
// rows, in the order of their last change. The server returns the number of the last entry that it
// has. A portion whose answer was lost is therefore neither repeated nor left out. The whole map is
// sent if the server does not have it or has missed changes.
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
  std::int64_t sent = 0;  ///< the server has the entries of the outbox up to this one
  bool whole = false;     ///< whether the server has a complete state of the file
};

class Pusher {
 public:
  /// `earth_anchor` is as in server_url.h. The file is only read.
  Pusher(std::string file, std::string vehicle, std::vector<double> earth_anchor);

  /// Opens the file and asks the server for the last entry that it has. Call it before the first
  /// push on each link, and again after any failure.
  Result<void> attach(Link& link);
  /// Sends at most `most_rows` rows. `whole` of the result is true if none remain.
  Result<Portion> push(Link& link, std::int64_t most_rows);
  /// Replaces the map of this vehicle by the pusher's file, which needs no outbox, in one
  /// transaction. `file` is the identity of the map's file on the server.
  Result<void> replaceAll(Link& link, const std::string& file);
  /// Whether rows remain to be sent.
  Result<bool> hasMore() const;

  std::int64_t sent() const { return at_.sent; }
  std::int64_t number() const { return map_; }  ///< number of the map on the server

 private:
  struct Place {
    std::int64_t sent = 0, next_table = kOutboxTables, next_id = 0;
  };
  struct Draft;  ///< a portion that is being composed
  // These throw Failed; the public functions return its reason.
  void openFile(bool with_outbox);
  void introduce(Link& link);
  void readChanges(Link& link, Draft& draft) const;
  void readWhole(Link& link, Draft& draft) const;
  void queueRow(Link& link, OutboxTable table, std::int64_t id) const;
  void queueWorking(Link& link) const;
  void queueRows(Link& link, OutboxTable table, Draft& draft) const;
  Portion pushPortion(Link& link, std::int64_t most_rows, bool as_transaction);
  void queueAdvance(Link& link, const Draft& draft, const std::string& outbox) const;

  const std::string file_, vehicle_;
  const std::vector<double> earth_anchor_;
  std::vector<double> told_earth_;  ///< position on Earth as last sent: the configured one or that
                                    ///< of the file
  std::optional<Connection> connection_;
  OutboxMark mark_;
  bool has_outbox_ = true;
  std::int64_t map_ = 0;
  Place at_;
};

}  // namespace perdure::map_store::fleet
