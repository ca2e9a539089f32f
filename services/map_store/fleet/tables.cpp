#include "services/map_store/fleet/tables.h"

#include <array>
#include <sstream>
#include <string_view>

#include "common/base/check.h"

namespace perdure::map_store::fleet {
namespace {

/// Parses the columns of a table. Each is "TYPE:NAME" with the type i (integer), r (real), t (text)
/// or b (blob).
Table tableFrom(const std::string& name, const std::string& columns, bool has_nulls = false) {
  constexpr std::string_view kTypes = "irtb";  // in the order of Kind
  Table table{name, {}, has_nulls};
  std::istringstream words(columns);
  for (std::string word; words >> word;) {
    table.columns.push_back({word.substr(2), static_cast<Kind>(kTypes.find(word[0]))});
  }
  return table;
}

std::array<Table, static_cast<std::size_t>(kOutboxTables) - 1> makeTables() {
  return {
      tableFrom("graph_classes", "i:number t:name"),
      tableFrom("anchors",
                "i:id i:previous i:world i:epoch i:source i:sequence i:time_ns r:way_m b:anchor"),
      tableFrom("anchor_poses", "i:id r:x r:y r:z r:yaw i:held_fast"),
      tableFrom("edges", "i:id i:a i:b i:kind r:weight b:edge"),
      tableFrom("objects",
                "i:id i:world i:epoch t:class r:class_probability r:existence r:x r:y r:z r:yaw "
                "r:length r:width r:height i:first_seen_ns i:last_seen_ns i:hits i:visibility "
                "i:memory i:tile_x i:tile_y i:gone i:gone_ns i:merged_into b:belief",
                true),
      tableFrom("sightings",
                "i:id i:anchor i:world i:epoch i:last_seen_ns r:x r:y r:z r:yaw b:record"),
      tableFrom("views", "i:anchor b:points")};
}

const char* typeOf(Kind kind) {
  switch (kind) {
    case Kind::kInteger:
      return "bigint";
    case Kind::kReal:
      return "float8";
    case Kind::kText:
      return "text";
    case Kind::kBlob:
      return "bytea";
  }
  return "";
}

std::string placeholders(const Table& table, const std::string& sign, std::size_t first) {
  std::string text;
  for (std::size_t i = 0; i < table.columns.size(); ++i) {
    text += (i == 0 ? "" : ", ") + sign + std::to_string(first + i);
  }
  return text;
}

}  // namespace

const Table& tableOf(OutboxTable table) {
  static const auto tables = makeTables();
  const auto number = static_cast<std::size_t>(table);
  perdure::check(number < tables.size(), "a table of the outbox that has rows");
  return tables[number];
}

const Table& workingTable() {
  static const Table table = tableFrom("working", "i:position i:id b:belief", true);
  return table;
}

std::string columnsOf(const Table& table) {
  std::string text;
  for (const Column& column : table.columns) text += (text.empty() ? "" : ", ") + column.name;
  return text;
}

std::string creationOf(const Table& table) {
  std::string sql = "CREATE TABLE perdure." + table.name + "(map bigint NOT NULL";
  for (const Column& column : table.columns) {
    sql += ", " + column.name + " " + typeOf(column.kind) + (table.has_nulls ? "" : " NOT NULL");
  }
  return sql + ", PRIMARY KEY(map, " + table.columns.front().name + "));\n";
}

std::string upsertOf(const Table& table) {
  const std::string& key = table.columns.front().name;
  std::string sql = "INSERT INTO perdure." + table.name + "(map, " + columnsOf(table) +
                    ") VALUES($1, " + placeholders(table, "$", 2) + ") ON CONFLICT(map, " + key +
                    ") DO UPDATE SET ";
  for (std::size_t i = 1; i < table.columns.size(); ++i) {
    const std::string& name = table.columns[i].name;
    sql += (i == 1 ? "" : ", ") + name + " = EXCLUDED." + name;
  }
  return sql;
}

std::string selectionOf(const Table& table) {
  return "SELECT " + columnsOf(table) + " FROM " + table.name;
}

std::string insertionOf(const Table& table) {
  return "INSERT INTO " + table.name + "(" + columnsOf(table) + ") VALUES(" +
         placeholders(table, "?", 1) + ")";
}

Values valuesOf(const Table& table, std::int64_t map, const Statement& row) {
  Values values;
  values.put(map);
  for (int i = 0; i < static_cast<int>(table.columns.size()); ++i) {
    if (row.isNull(i)) {
      values.null();
      continue;
    }
    switch (table.columns[static_cast<std::size_t>(i)].kind) {
      case Kind::kInteger:
        values.put(row.integer(i));
        break;
      case Kind::kReal:
        values.put(row.real(i));
        break;
      case Kind::kText:
        values.put(std::string_view(row.text(i)));
        break;
      case Kind::kBlob:
        values.put(row.blob(i));
        break;
    }
  }
  return values;
}

void bindRow(const Table& table, const Answer& answer, int row, Statement& to) {
  for (int i = 0; i < static_cast<int>(table.columns.size()); ++i) {
    if (answer.isNull(row, i)) {
      to.bindNull(i + 1);
      continue;
    }
    switch (table.columns[static_cast<std::size_t>(i)].kind) {
      case Kind::kInteger:
        to.bind(i + 1, answer.integer(row, i));
        break;
      case Kind::kReal:
        to.bind(i + 1, answer.real(row, i));
        break;
      case Kind::kText:
        to.bind(i + 1, std::string_view(answer.text(row, i)));
        break;
      case Kind::kBlob:
        to.bind(i + 1, answer.blob(row, i));
        break;
    }
  }
}

}  // namespace perdure::map_store::fleet
