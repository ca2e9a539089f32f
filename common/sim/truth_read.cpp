#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <concepts>
#include <fstream>
#include <functional>
#include <iterator>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string_view>

#include "common/base/errors.h"
#include "common/sim/truth.h"

namespace perdure::sim {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

[[noreturn]] void refuse(const std::string& where, const std::string& what) {
  throw StartupError(ExitCode::kUnavailable,
                     where + ": " + what + "; make the folder anew with perdure simulate");
}

std::ifstream open(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream || fs::is_directory(file)) refuse(file.string(), "is missing or cannot be read");
  return stream;
}

/// Whether a value has the type of T; the library would also convert booleans and fractions.
template <class T>
bool isA(const Json& value) {
  if (std::same_as<T, bool>) return value.is_boolean();
  if (std::same_as<T, std::string>) return value.is_string() && value != "";
  if (std::integral<T>) return value.is_number_integer();
  return !std::floating_point<T> || value.is_number();
}

/// Reads a member of a JSON object; `kind` names the required type in the error message.
template <class T>
T member(const Json& parent, const char* key, const std::string& where, const char* kind) {
  const auto found = parent.find(key);
  if (found == parent.end()) refuse(where, std::string(key) + " is missing");
  try {
    if (isA<T>(*found)) return *found;
  } catch (const Json::exception&) {
  }
  refuse(where, std::string(key) + " is not " + kind);
}

std::int64_t integer(const Json& parent, const char* key, const std::string& where) {
  return member<std::int64_t>(parent, key, where, "an integer");
}

Eigen::Vector3d vector(const Json& parent, const char* key, const std::string& where) {
  const Json list = member<Json>(parent, key, where, "3 numbers");
  if (!list.is_array() || list.size() != 3 || !std::ranges::all_of(list, isA<double>)) {
    refuse(where, std::string(key) + " has not 3 numbers");
  }
  const auto numbers = list.get<std::vector<double>>();
  return Eigen::Vector3d(numbers.data());
}

std::vector<TruthKey> keysOf(const Json& list, const std::string& where) {
  if (!list.is_array() || list.empty()) refuse(where, "keys is not a list with at least one");
  std::vector<TruthKey> keys;
  for (const Json& item : list) {
    keys.push_back({fromNanoseconds(integer(item, "time_ns", where)), vector(item, "centre", where),
                    member<double>(item, "yaw", where, "a number")});
    if (keys.size() > 1 && keys.back().time <= keys[keys.size() - 2].time) {
      refuse(where, "keys are not in the order of time");
    }
  }
  return keys;
}

TruthObject objectOf(const Json& json, const std::string& where) {
  TruthObject object;
  object.id = static_cast<std::uint64_t>(integer(json, "id", where));
  if (integer(json, "id", where) < 1) refuse(where, "id is not above 0");
  object.class_name = member<std::string>(json, "class", where, "a name");
  object.looks_like = member<std::string>(json, "looks_like", where, "a name");
  object.size = vector(json, "size", where);
  if (object.size.minCoeff() <= 0) refuse(where, "size is not above 0");
  object.moves = member<bool>(json, "moves", where, "true or false");
  object.present_from = fromNanoseconds(integer(json, "present_from_ns", where));
  object.present_until = fromNanoseconds(integer(json, "present_until_ns", where));
  if (object.present_until <= object.present_from) {
    refuse(where, "present_until_ns is not after present_from_ns");
  }
  object.keys = keysOf(member<Json>(json, "keys", where, "a list"), where);
  return object;
}

std::vector<TruthObject> readObjects(const fs::path& file) {
  std::ifstream stream = open(file);
  const std::string text{std::istreambuf_iterator<char>(stream), {}};
  Json root;
  try {
    root = Json::parse(text);
  } catch (const Json::exception& error) {
    refuse(file.string(), std::string("is cut or no JSON (") + error.what() + ")");
  }
  if (!root.is_object() || !root.contains("objects") || !root["objects"].is_array()) {
    refuse(file.string(), "has no list named objects");
  }
  std::vector<TruthObject> objects;
  std::set<std::uint64_t> ids;
  for (const Json& item : root["objects"]) {
    const std::string where = file.string() + ": objects[" + std::to_string(objects.size()) + "]";
    objects.push_back(objectOf(item, where));
    if (!ids.insert(objects.back().id).second) refuse(where, "its id was there before");
  }
  return objects;
}

template <class Number>
std::optional<Number> parse(std::string_view text) {
  Number value{};
  const auto result = std::from_chars(text.data(), text.data() + text.size(), value);
  if (result.ec != std::errc{} || result.ptr != text.data() + text.size()) return std::nullopt;
  return value;
}

/// A row that begins with a frame and an object id.
template <std::size_t N>
struct Row {
  std::uint64_t frame = 0, object = 0;
  std::array<double, N> numbers{};
};

/// The numbers of a row. Returns nothing if the row is malformed.
template <std::size_t N>
std::optional<Row<N>> parseRow(std::string_view line) {
  std::vector<std::string_view> fields;
  for (std::size_t begin = 0; begin <= line.size();) {
    const std::size_t end = std::min(line.find(',', begin), line.size());
    fields.push_back(line.substr(begin, end - begin));
    begin = end + 1;
  }
  if (fields.size() != N + 2) return std::nullopt;
  const auto frame = parse<std::uint64_t>(fields[0]), id = parse<std::uint64_t>(fields[1]);
  if (!frame || !id) return std::nullopt;
  Row<N> row{*frame, *id, {}};
  for (std::size_t i = 0; i < N; ++i) {
    const auto number = parse<double>(fields[i + 2]);
    if (!number || !std::isfinite(*number)) return std::nullopt;
    row.numbers[i] = *number;
  }
  return row;
}

/// Passes each row of a file with this header to `use`, with file and line for error messages.
template <std::size_t N>
void readRows(const fs::path& file, const char* header, const char* numbers,
              const std::function<void(const std::string&, const Row<N>&)>& use) {
  std::ifstream stream = open(file);
  std::string line;
  std::size_t number = 1;
  for (; std::getline(stream, line); ++number) {
    const std::string where = file.string() + ":" + std::to_string(number);
    if (stream.eof()) refuse(where, "the file was cut within this line");
    if (line.ends_with('\r')) line.pop_back();
    if (number == 1) {
      if (line != header) refuse(where, std::string("the header is not ") + header);
      continue;
    }
    const auto row = parseRow<N>(line);
    if (!row) refuse(where, std::string("is not a row of ") + numbers + " finite numbers");
    use(where, *row);
  }
  if (number == 1) refuse(file.string(), "is empty");
}

std::map<std::uint64_t, std::vector<TruthView>> readViews(const fs::path& file,
                                                          const std::vector<TruthObject>& objects) {
  std::set<std::uint64_t> ids;
  for (const TruthObject& object : objects) ids.insert(object.id);
  std::map<std::uint64_t, std::vector<TruthView>> views;
  std::set<std::pair<std::uint64_t, std::uint64_t>> seen;
  readRows<5>(file, kVisibilityHeader, "seven", [&](const std::string& where, const Row<5>& row) {
    const auto& [share, x1, y1, x2, y2] = row.numbers;
    if (!ids.contains(row.object)) refuse(where, "its object is not in objects_truth.json");
    if (share < 0 || share > 1) refuse(where, "visible_fraction is not within 0 and 1");
    if (x1 >= x2 || y1 >= y2) refuse(where, "its box is empty");
    if (!seen.insert({row.frame, row.object}).second)
      refuse(where, "the object was in this frame before");
    views[row.frame].push_back({row.object, share, Box{x1, y1, x2, y2}, std::nullopt});
  });
  return views;
}

/// Adds the boxes inside the image, unless an earlier version wrote the folder without this file.
void readInside(const fs::path& file, std::map<std::uint64_t, std::vector<TruthView>>& views) {
  if (!fs::exists(file)) return;
  readRows<4>(file, kInsideHeader, "six", [&](const std::string& where, const Row<4>& row) {
    const auto& [x1, y1, x2, y2] = row.numbers;
    const auto frame = views.find(row.frame);
    if (frame == views.end()) refuse(where, "its frame is not in visibility_truth.csv");
    const auto view = std::ranges::find_if(
        frame->second, [&](const auto& v) { return v.object_id == row.object; });
    if (view == frame->second.end()) refuse(where, "its object is not in visibility_truth.csv");
    if (x1 > x2 || y1 > y2) refuse(where, "its box is inside out");
    view->inside = Box{x1, y1, x2, y2};
  });
}

}  // namespace

bool hasTruth(const fs::path& folder) { return fs::is_regular_file(folder / kObjectsTruthFile); }

Truth readTruth(const fs::path& folder) {
  Truth truth;
  truth.objects = readObjects(folder / kObjectsTruthFile);
  truth.views = readViews(folder / kVisibilityTruthFile, truth.objects);
  readInside(folder / kInsideTruthFile, truth.views);
  return truth;
}

}  // namespace perdure::sim
