// Which rows of a map's file have changed and are not known to be on a fleet's server: an outbox,
// written by the file's own triggers within the transaction that changes the row.
#pragma once

#include <cstdint>
#include <string>

#include "common/base/result.h"
#include "services/map_store/core/sqlite.h"

namespace perdure::map_store {

/// Tables whose rows the outbox names, by their number there. Ends of edges and anchors of
/// sightings come before what hangs on them.
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

/// Where an outbox stands. Each change has a number larger than all before it.
struct OutboxMark {
  std::string file;    ///< 32 hexadecimal digits that the file keeps for ever; copies have the same
  std::string outbox;  ///< 32 that change when the outbox is begun anew, having missed changes
  std::int64_t acknowledged = 0;  ///< entries up to this one were taken away
  std::int64_t last = 0;          ///< the newest number given
};

/// Makes the outbox where there is none, and anew where it does not follow every table. All or
/// nothing.
Result<void> openOutbox(const Connection& connection);
/// Removes it: without a server it would gather what nobody takes.
Result<void> dropOutbox(const Connection& connection);
/// Within the caller's transaction: takes entries up to `number` away.
Result<void> acknowledge(const Connection& connection, std::int64_t number);
/// "no_outbox" where the file has none.
Result<OutboxMark> outboxMark(const Connection& connection);

}  // namespace perdure::map_store
