// Tables that both a map's file and the server have, and the bit-exact transfer of their rows.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "services/map_store/core/outbox.h"
#include "services/map_store/core/sqlite.h"
#include "services/map_store/fleet/link.h"

namespace perdure::map_store::fleet {

enum class Kind { kInteger, kReal, kText, kBlob };

struct Column {
  std::string name;
  Kind kind;
};

/// A table of OutboxTable except kWorking. The first column is the key.
struct Table {
  std::string name;
  std::vector<Column> columns;
  bool has_nulls = false;
};

const Table& tableOf(OutboxTable table);
/// The table `working`: positions and ids of the working set's tracks, and beliefs that no other
/// table has.
const Table& workingTable();

/// Returns "CREATE TABLE perdure.…" for the server.
std::string creationOf(const Table& table);
/// Returns "INSERT … ON CONFLICT …" for the server. $1 is the map's number; the columns begin at
/// $2.
std::string upsertOf(const Table& table);
/// Returns "SELECT …" of all columns from the file.
std::string selectionOf(const Table& table);
/// Returns "INSERT …" of all columns into a file.
std::string insertionOf(const Table& table);
std::string columnsOf(const Table& table);

/// Returns the current row of the statement `row` as parameters of upsertOf().
Values valuesOf(const Table& table, std::int64_t map, const Statement& row);
/// Binds a row from the server, whose columns are those of `table`, to a statement of
/// insertionOf().
void bindRow(const Table& table, const Answer& answer, int row, Statement& to);

}  // namespace perdure::map_store::fleet
