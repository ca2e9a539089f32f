// The outbox: a table with the ids of changed rows that the fleet's server has not confirmed.
// Triggers write it.
#pragma once

#include <cstdint>
#include <string>

#include "common/base/result.h"
#include "services/map_store/core/sqlite.h"

namespace perdure::map_store {

/// Numbers of the tables in the outbox. A row refers only to rows of tables with lower numbers.
enum class OutboxTable : std::int64_t {
  kClasses = 0,
  kAnchors = 1,
  kPoses = 2,
  kEdges = 3,
  kObjects = 4,
  kSightings = 5,
  kViews = 6,
  kWorking = 7,  ///< working set, its header, and the map's revision: one entry, id 0
};
inline constexpr std::int64_t kOutboxTables = 8;

/// The state of an outbox. Each change has a larger number than all earlier ones.
struct OutboxMark {
  std::string file;    ///< 32 hexadecimal digits that never change; copies have the same digits
  std::string outbox;  ///< 32 hexadecimal digits that change when the outbox is created again
  std::int64_t acknowledged = 0;  ///< entries up to this one were removed
  std::int64_t last = 0;          ///< number of the newest change
};

// These throw Failed (sqlite.h).

/// Creates the outbox if there is none, and creates it again if triggers of a table are missing.
/// All or nothing.
void openOutbox(const Connection& connection);
/// Removes the outbox, because without a server it would only grow.
void dropOutbox(const Connection& connection);
/// Removes the entries up to `number`. Runs within the caller's transaction.
void acknowledge(const Connection& connection, std::int64_t number);
/// Reads the state of the outbox. Fails with "no_outbox" if the file has none.
Result<OutboxMark> outboxMark(const Connection& connection);

}  // namespace perdure::map_store
