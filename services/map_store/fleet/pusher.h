// Sends the changes in a map's file to the server, in portions that are one transaction each: the
// current rows, in the order of their last change. The server reports its last entry, so a portion
// whose answer was lost is neither repeated nor left out. The whole map is sent if the server has
// none or has missed changes.
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
  /// `earth_anchor`: parameters.h. The file is opened read-only.
  Pusher(std::string file, std::string vehicle, std::vector<double> earth_anchor);

  /// Reads the server's last entry. Must precede the first push on each link, and the first push
  /// after any failure.
  Result<void> attach(Link& link);
  /// Sends at most `most_rows` rows. If fewer remain, the portion is smaller, and `whole`.
  Result<Portion> push(Link& link, std::int64_t most_rows);
  /// For a file without outbox: copies `file` to this vehicle's map, in one transaction.
  Result<void> replaceAll(Link& link, const std::string& file);
  /// Whether the file has entries that were not sent.
  Result<bool> hasMore() const;

  std::int64_t sent() const { return at_.sent; }
  std::int64_t number() const { return map_; }  ///< number of the map on the server

 private:
  struct Place {
    std::int64_t sent = 0, next_table = kOutboxTables, next_id = 0;
  };
  struct Draft;  ///< a portion under construction
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
  std::vector<double> told_earth_;  ///< position on Earth as last sent: the given one or the file's
  std::optional<Connection> connection_;
  OutboxMark mark_;
  bool has_outbox_ = true;
  std::int64_t map_ = 0;
  Place at_;
};

}  // namespace perdure::map_store::fleet
