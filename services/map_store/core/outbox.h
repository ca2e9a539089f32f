// The outbox: changed rows that are not known to be on a fleet's server, written by triggers.
#pragma once

#include <cstdint>
#include <string>

#include "common/base/result.h"
#include "services/map_store/core/sqlite.h"

namespace perdure::map_store {

/// Numbers of the tables in the outbox. References of a row are in tables with lower numbers.
enum class OutboxTable : std::int64_t {
  kClasses = 0,
  kAnchors = 1,
  kPoses = 2,
  kEdges = 3,
  kObjects = 4,
  kSightings = 5,
  kViews = 6,
  kWorking = 7,  ///< the working set with its header and the map's revision: one entry, id 0
};
inline constexpr std::int64_t kOutboxTables = 8;

/// The state of an outbox. Each change has a larger number than all earlier ones.
struct OutboxMark {
  std::string file;    ///< 32 hexadecimal digits that never change; copies have the same
  std::string outbox;  ///< 32 digits that change when the outbox restarts after missed changes
  std::int64_t acknowledged = 0;  ///< entries up to this one were removed
  std::int64_t last = 0;          ///< number of the newest change
};

// These throw Failed (sqlite.h).

/// Creates the outbox if there is none, or again if it does not follow every table. All or nothing.
void openOutbox(const Connection& connection);
/// Removes the outbox: without a server it would only grow.
void dropOutbox(const Connection& connection);
/// Removes the entries up to `number`, within the caller's transaction.
void acknowledge(const Connection& connection, std::int64_t number);
/// Reason of failure: "no_outbox" if the file has none.
Result<OutboxMark> outboxMark(const Connection& connection);

}  // namespace perdure::map_store
