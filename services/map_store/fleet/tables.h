// The tables that a map's file and the server share, and the bit-exact transfer of their rows.
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
/// `working`: positions, ids and beliefs that no other table has.
const Table& workingTable();

/// "CREATE TABLE perdure.…" for the server.
std::string creationOf(const Table& table);
/// "INSERT … ON CONFLICT …" with the map's number as $1 and the columns from $2.
std::string upsertOf(const Table& table);
/// "SELECT …" of all columns from the file.
std::string selectionOf(const Table& table);
/// "INSERT …" of all columns, into a file.
std::string insertionOf(const Table& table);
std::string columnsOf(const Table& table);

/// The current row of `row`, as parameters of upsertOf.
Values valuesOf(const Table& table, std::int64_t map, const Statement& row);
/// The reverse: binds a row of the server to insertionOf, with columns as in `table`.
void bindRow(const Table& table, const Answer& answer, int row, Statement& to);

}  // namespace perdure::map_store::fleet
