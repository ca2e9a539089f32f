#include "services/map_store/fleet/tables.h"

#include <array>

#include "common/base/check.h"

namespace perdure::map_store::fleet {
namespace {

constexpr Kind kInteger = Kind::kInteger, kReal = Kind::kReal, kText = Kind::kText,
               kBlob = Kind::kBlob;

std::array<Table, static_cast<std::size_t>(kOutboxTables) - 1> makeTables() {
  return {Table{"graph_classes", {{"number", kInteger}, {"name", kText}}},
          Table{"anchors",
                {{"id", kInteger},
                 {"previous", kInteger},
                 {"world", kInteger},
                 {"epoch", kInteger},
                 {"source", kInteger},
                 {"sequence", kInteger},
                 {"time_ns", kInteger},
                 {"way_m", kReal},
                 {"anchor", kBlob}}},
          Table{"anchor_poses",
                {{"id", kInteger},
                 {"x", kReal},
                 {"y", kReal},
                 {"z", kReal},
                 {"yaw", kReal},
                 {"held_fast", kInteger}}},
          Table{"edges",
                {{"id", kInteger},
                 {"a", kInteger},
                 {"b", kInteger},
                 {"kind", kInteger},
                 {"weight", kReal},
                 {"edge", kBlob}}},
          Table{"objects",
                {{"id", kInteger},
                 {"world", kInteger},
                 {"epoch", kInteger},
                 {"class", kText},
                 {"class_probability", kReal},
                 {"existence", kReal},
                 {"x", kReal},
                 {"y", kReal},
                 {"z", kReal},
                 {"yaw", kReal},
                 {"length", kReal},
                 {"width", kReal},
                 {"height", kReal},
                 {"first_seen_ns", kInteger},
                 {"last_seen_ns", kInteger},
                 {"hits", kInteger},
                 {"visibility", kInteger},
                 {"memory", kInteger},
                 {"tile_x", kInteger},
                 {"tile_y", kInteger},
                 {"gone", kInteger},
                 {"gone_ns", kInteger},
                 {"merged_into", kInteger},
                 {"belief", kBlob}},
                true},
          Table{"sightings",
                {{"id", kInteger},
                 {"anchor", kInteger},
                 {"world", kInteger},
                 {"epoch", kInteger},
                 {"last_seen_ns", kInteger},
                 {"x", kReal},
                 {"y", kReal},
                 {"z", kReal},
                 {"yaw", kReal},
                 {"record", kBlob}}},
          Table{"views", {{"anchor", kInteger}, {"points", kBlob}}}};
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
  static const Table table{
      "working", {{"position", kInteger}, {"id", kInteger}, {"belief", kBlob}}, true};
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
