#include "tools/data_check/repaired_text.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>
#include <optional>

#include "common/base/algorithms/median.h"
#include "common/base/checked_file.h"
#include "common/base/errors.h"
#include "common/replay/clock_check.h"
#include "common/replay/files/stamps.h"
#include "common/replay/files/text_file.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;
using replay::split;

constexpr double kLeastGravity = 8.3, kMostGravity = 11.3;
constexpr char kSeven[] =
    "timestamp [ns], w_x, w_y, w_z [rad/s], a_x, a_y, a_z [m/s^2] are awaited";

struct Table {
  fs::path file;
  std::vector<std::string> head;
  std::vector<std::vector<std::string>> rows;
};

char separatorIn(const std::string& line) {
  for (const char one : {',', ';'}) {
    if (line.find(one) != line.npos) return one;
  }
  return ' ';
}

std::vector<std::string> wordsOf(const std::string& line) {
  const auto fields = split(line, separatorIn(line));
  std::vector<std::string> words(fields.begin(), fields.end());
  while (words.size() > 1 && words.back().empty()) words.pop_back();
  return words;
}

Table tableOf(const fs::path& file) {
  Table table{file, {}, {}};
  for (const auto& line : replay::readLines(file, "EuRoC keeps data.csv in each folder")) {
    const bool number = line.text.find_first_of("0123456789+-.") == 0;
    if (number) {
      table.rows.push_back(wordsOf(line.text));
    } else if (table.head.empty() && table.rows.empty()) {
      table.head = wordsOf(replay::toLower(line.text.substr(line.text.starts_with('#') ? 1 : 0)));
    }
  }
  return table;
}

/// Returns `text` (a decimal number, also with an exponent) times 10^places as an integer number of
/// nanoseconds. Empty if it is no decimal number, or too large.
std::optional<std::string> shifted(std::string_view text, std::size_t places) {
  text = replay::trim(text);
  std::int64_t exponent = 0;
  if (const auto e = text.find_first_of("eE"); e != text.npos) {
    const auto value = replay::parseInteger(text.substr(e + 1));
    if (!value || std::abs(*value) > 64) return std::nullopt;
    exponent = *value;
    text = text.substr(0, e);
  }
  if (text.starts_with('+')) text.remove_prefix(1);
  const auto point = std::min(text.find('.'), text.size());
  std::string digits(text.substr(0, point));
  if (point < text.size()) digits += text.substr(point + 1);
  const bool number =
      std::all_of(digits.begin(), digits.end(), [](char c) { return c >= '0' && c <= '9'; });
  if (digits.empty() || !number) return std::nullopt;
  const auto whole =
      static_cast<std::int64_t>(point) + exponent + static_cast<std::int64_t>(places);
  // Digits below a nanosecond are dropped.
  digits.resize(static_cast<std::size_t>(std::max<std::int64_t>(whole, 0)), '0');
  digits.erase(0, digits.find_first_not_of('0'));
  if (digits.empty()) digits = "0";
  return replay::parseNanoseconds(digits) ? std::optional(digits) : std::nullopt;
}

/// Number of decimal places from the unit of the stamps to nanoseconds; 0 if they are nanoseconds.
std::size_t placesShort(const Table& table) {
  std::size_t others = 0;
  std::vector<double> values;
  for (const auto& row : table.rows) {
    const auto value = replay::parseNumber(row[0]);
    if (!value) continue;
    values.push_back(*value);
    if (!replay::parseNanoseconds(row[0])) ++others;
  }
  if (values.empty() || 2 * others < values.size()) return 0;
  const double middle = medianOf(std::move(values));
  return middle >= 1e14 ? 3 : middle >= 1e11 ? 6 : 9;
}

/// Integer stamps in another unit: decimal places to nanoseconds, detected from the rates of IMU
/// and camera.
struct WholeUnit {
  std::size_t places = 0;
  double least = 0.0, most = 0.0;  ///< range of stamps in that unit, with a margin
};

std::vector<TimePoint> wholeStampsOf(const Table& table) {
  std::vector<TimePoint> stamps;
  for (const auto& row : table.rows) {
    if (const auto stamp = replay::parseNanoseconds(row[0])) stamps.push_back(*stamp);
  }
  return stamps;
}

WholeUnit wholeUnitOf(const fs::path& mav0) {
  std::error_code error;
  const fs::path imu = mav0 / "imu0" / "data.csv", images = mav0 / "cam0" / "data.csv";
  if (!fs::is_regular_file(imu, error) || !fs::is_regular_file(images, error)) return {};
  const auto of_imu = wholeStampsOf(tableOf(imu)), of_images = wholeStampsOf(tableOf(images));
  const auto factor = replay::factorOfStamps(of_imu, of_images);
  if (factor == 1) return {};
  const auto [least, most] = std::minmax_element(of_imu.begin(), of_imu.end());
  const auto length = toNanoseconds(*most) - toNanoseconds(*least);
  return {factor == 1000 ? 3U : 6U, static_cast<double>(toNanoseconds(*least) - length),
          static_cast<double>(toNanoseconds(*most) + length)};
}

/// Tested for each table, because ground truth and speed may be in nanoseconds already.
bool isOf(const WholeUnit& unit, const Table& table) {
  if (unit.places == 0 || table.rows.empty()) return false;
  const auto stamp = replay::parseNumber(table.rows[table.rows.size() / 2][0]);
  return stamp && *stamp >= unit.least && *stamp <= unit.most;
}

/// Refuses seconds whose decimals lack their leading zeros ("%d.%d" of seconds and nanoseconds):
/// they are in order only with these zeros.
void refuseUnpadded(const Table& table) {
  std::vector<std::pair<std::string, std::string>> written;
  for (const auto& row : table.rows) {
    const auto dot = row[0].find('.');
    if (dot == row[0].npos) return;
    written.emplace_back(row[0].substr(0, dot), row[0].substr(dot + 1));
  }
  if (std::ranges::is_sorted(written)) return;
  std::size_t longest = 0;
  for (const auto& [whole, decimals] : written) longest = std::max(longest, decimals.size());
  for (auto& [whole, decimals] : written) decimals.insert(0, longest - decimals.size(), '0');
  if (!std::ranges::is_sorted(written)) return;
  throw StartupError(ExitCode::kData,
                     "{}: the decimals of the stamps lack their leading zeros; write seconds and "
                     "nanoseconds with \"%d.%09d\"",
                     table.file.string());
}

bool repairStamps(Table& table, const WholeUnit& whole, std::vector<std::string>& fixes) {
  std::size_t places = placesShort(table);
  if (places == 0 && isOf(whole, table)) places = whole.places;
  if (places == 0) return false;
  if (const auto why = replay::whyDateDigits(table.rows.front()[0]); !why.empty()) {
    throw StartupError(ExitCode::kData, "{}: the first stamp, {}", table.file.string(), why);
  }
  if (places == 9) refuseUnpadded(table);
  const char* unit = places == 9 ? "seconds" : places == 6 ? "milliseconds" : "microseconds";
  for (auto& row : table.rows) {
    auto stamp = shifted(row[0], places);
    if (!stamp) {
      throw StartupError(ExitCode::kData,
                         fmt::format("{}: most stamps are {}, and `{}` is no such stamp; correct "
                                     "or remove that line",
                                     table.file.string(), unit, row[0]));
    }
    row[0] = *std::move(stamp);
  }
  fixes.push_back(
      fmt::format("{}: the stamps are nanoseconds now (they were {})", table.file.string(), unit));
  return true;
}

enum class Column { kOther, kTurn, kForce };

Column columnNamed(const std::string& name) {
  const auto has = [&](const char* part) { return name.find(part) != name.npos; };
  if (has("orient") || has("roll") || has("pitch") || has("yaw") || has("quat")) {
    return Column::kOther;
  }
  if (has("angular") || has("gyr") || has("omega") || name.starts_with('w')) return Column::kTurn;
  const bool force = has("accel") || has("linear") || name.starts_with("a_") || name == "ax" ||
                     name == "ay" || name == "az";
  return force ? Column::kForce : Column::kOther;
}

/// Returns the axis letter if it is a separate word of the name or the last letter before a unit;
/// else 0.
char axisOf(const std::string& name) {
  const std::string bare = name.substr(0, name.find_first_of("[("));
  const auto letter = [&](std::size_t i) {
    return i < bare.size() && std::isalnum(static_cast<unsigned char>(bare[i])) != 0;
  };
  char axis = 0;
  for (std::size_t i = 0; i < bare.size(); ++i) {
    if (bare[i] < 'x' || bare[i] > 'z' || letter(i + 1)) continue;
    if (i == 0 || !letter(i - 1)) return bare[i];
    axis = bare[i];
  }
  return axis;
}

using Six = std::vector<std::size_t>;  ///< columns of w_x, w_y, w_z, a_x, a_y, a_z

std::optional<Six> byHead(const Table& table, std::size_t columns) {
  if (table.head.size() != columns) return std::nullopt;
  Six turns, forces;
  for (std::size_t i = 1; i < columns; ++i) {
    const Column column = columnNamed(table.head[i]);
    if (column == Column::kTurn) turns.push_back(i);
    if (column == Column::kForce) forces.push_back(i);
  }
  if (turns.size() != 3 || forces.size() != 3) return std::nullopt;
  turns.insert(turns.end(), forces.begin(), forces.end());
  for (std::size_t i = 0; i < 6; ++i) {
    if (axisOf(table.head[turns[i]]) == "xyz"[i % 3]) continue;
    throw StartupError(
        ExitCode::kData,
        fmt::format("{}: the column `{}` stands where the axis {} is awaited; name and order the "
                    "columns by axis x, y, z, such as w_x,w_y,w_z,a_x,a_y,a_z",
                    table.file.string(), table.head[turns[i]], "xyz"[i % 3]));
  }
  return turns;
}

/// Median length and its deviation, of the vectors in `count` columns from `first` on.
struct Length {
  double median = 0, spread = 0;
};

Length lengthOf(const Table& table, std::size_t first, std::size_t count) {
  std::vector<double> lengths;
  for (const auto& row : table.rows) {
    double sum = 0;
    for (std::size_t i = first; i < first + count && i < row.size(); ++i) {
      const double value = replay::parseNumber(row[i]).value_or(NAN);
      sum += value * value;
    }
    if (std::isfinite(sum)) lengths.push_back(std::sqrt(sum));
  }
  if (lengths.empty()) return {};
  std::sort(lengths.begin(), lengths.end());
  const double median = lengths[lengths.size() / 2];
  return {median, std::max(median - lengths.front(), lengths.back() - median)};
}

/// Finds the columns of a table without a header. Four columns of length 1 in every row are a
/// quaternion, and exactly one of the other two triples measures gravity.
std::optional<Six> byQuaternion(const Table& table, std::size_t columns) {
  if (columns != 11) return std::nullopt;
  std::optional<std::size_t> at;
  for (const std::size_t first : {1, 4, 7}) {
    const Length length = lengthOf(table, first, 4);
    if (std::abs(length.median - 1) > 1e-2 || length.spread > 1e-2) continue;
    if (at) return std::nullopt;
    at = first;
  }
  if (!at) return std::nullopt;
  Six rest;
  for (std::size_t i = 1; i < columns; ++i) {
    if (i < *at || i >= *at + 4) rest.push_back(i);
  }
  const auto isGravity = [&](std::size_t first) {
    const double length = lengthOf(table, first, 3).median;
    return length > kLeastGravity && length < kMostGravity;
  };
  if (isGravity(rest[0]) == isGravity(rest[3])) return std::nullopt;
  if (isGravity(rest[0])) std::rotate(rest.begin(), rest.begin() + 3, rest.end());
  return rest;
}

bool repairColumns(Table& table, std::vector<std::string>& fixes) {
  std::map<std::size_t, std::size_t> counts;
  for (const auto& row : table.rows) ++counts[row.size()];
  const auto usual = std::max_element(counts.begin(), counts.end(),
                                      [](auto& a, auto& b) { return a.second < b.second; });
  if (usual == counts.end() || usual->first == 7 || usual->first < 7) return false;
  const std::size_t columns = usual->first;
  auto six = byHead(table, columns);
  if (!six) six = byQuaternion(table, columns);
  if (!six) {
    throw StartupError(
        ExitCode::kData,
        fmt::format("{} has {} columns and {}; which are they? Name all of them in its first line, "
                    "such as #timestamp,roll,pitch,yaw,w_x,w_y,w_z,a_x,a_y,a_z",
                    table.file.string(), columns, kSeven));
  }
  for (auto& row : table.rows) {
    if (row.size() != columns) continue;  // the reader reports this row
    std::vector<std::string> kept = {row[0]};
    for (const std::size_t i : *six) kept.push_back(row[i]);
    row = std::move(kept);
  }
  table.head.clear();
  std::vector<std::size_t> numbers = *six;
  for (auto& n : numbers) ++n;
  fixes.push_back(fmt::format(
      "{}: of its {} columns {} are taken as w_x, w_y, w_z, a_x, a_y, a_z, the others left out",
      table.file.string(), columns, fmt::join(numbers, ", ")));
  return true;
}

void writeTable(const Table& table, const fs::path& to) {
  std::string text;
  if (!table.head.empty()) text += fmt::format("#{}\n", fmt::join(table.head, ","));
  for (const auto& row : table.rows) text += fmt::format("{}\n", fmt::join(row, ","));
  writeChecked(to, text);
}

/// Links all entries of `from` into `to`, except the one named `without`.
void linkAll(const fs::path& from, const fs::path& to, const std::string& without) {
  fs::create_directories(to);
  for (const auto& entry : fs::directory_iterator(from)) {
    if (entry.path().filename() == without) continue;
    fs::create_symlink(fs::absolute(entry.path()), to / entry.path().filename());
  }
}

}  // namespace

RepairedText::RepairedText(const fs::path& given) : drive_(given) {
  const fs::path absolute = fs::absolute(given).lexically_normal();
  const fs::path folder = absolute.has_filename() ? absolute : absolute.parent_path();
  const fs::path mav0 = folder.filename() == "mav0" ? folder : folder / "mav0";
  std::error_code error;
  if (!fs::is_directory(mav0, error)) return;
  std::vector<Table> changed;
  const WholeUnit whole = wholeUnitOf(mav0);
  for (const auto& sensor : fs::directory_iterator(mav0)) {
    const fs::path file = sensor.path() / "data.csv";
    if (!fs::is_regular_file(file, error)) continue;
    Table table = tableOf(file);
    const bool stamps = repairStamps(table, whole, fixes_);
    const bool columns =
        sensor.path().filename().string().starts_with("imu") && repairColumns(table, fixes_);
    if (stamps || columns) changed.push_back(std::move(table));
  }
  if (changed.empty()) return;
  temporary_.emplace(fs::temp_directory_path() / "perdure-repaired-", [](const std::string& name) {
    throw StartupError(ExitCode::kUnavailable, name + " cannot be made; is the disk full?");
  });
  drive_ = temporary_->path() / "drive";
  linkAll(mav0.parent_path(), drive_, mav0.filename());
  linkAll(mav0, drive_ / "mav0", "");
  for (const Table& table : changed) {
    const fs::path sensor = table.file.parent_path();
    const fs::path here = drive_ / "mav0" / sensor.filename();
    fs::remove(here);
    linkAll(sensor, here, "data.csv");
    writeTable(table, here / "data.csv");
  }
}

}  // namespace perdure::tools
