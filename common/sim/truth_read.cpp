#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <fstream>
#include <functional>
#include <iterator>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string_view>

#include "common/base/errors.h"
#include "common/sim/truth.h"
#include "common/sim/truth_files.h"

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

/// Reads one object of objects_truth.json; errors name the object and the cause.
class ObjectReader {
 public:
  ObjectReader(const Json& json, std::string where) : json_(json), where_(std::move(where)) {
    if (!json_.is_object()) refuse(where_, "is not an object with keys");
  }

  TruthObject read() const {
    TruthObject object;
    object.id = static_cast<std::uint64_t>(integer(json_, "id"));
    if (integer(json_, "id") < 1) refuse(where_, "id is not above 0");
    object.class_name = text("class");
    object.looks_like = text("looks_like");
    object.size = vector(json_, "size");
    if (object.size.minCoeff() <= 0) refuse(where_, "size is not above 0");
    object.moves = boolean("moves");
    object.present_from = fromNanoseconds(integer(json_, "present_from_ns"));
    object.present_until = fromNanoseconds(integer(json_, "present_until_ns"));
    if (object.present_until <= object.present_from) {
      refuse(where_, "present_until_ns is not after present_from_ns");
    }
    object.keys = keys();
    return object;
  }

 private:
  const Json& member(const Json& parent, const char* key) const {
    const auto found = parent.find(key);
    if (found == parent.end()) refuse(where_, std::string(key) + " is missing");
    return *found;
  }
  std::int64_t integer(const Json& parent, const char* key) const {
    const Json& value = member(parent, key);
    const bool fits = value.is_number_integer() &&
                      (!value.is_number_unsigned() || value.get<std::uint64_t>() <= INT64_MAX);
    if (!fits) refuse(where_, std::string(key) + " is not an integer of 64 bits");
    return value.get<std::int64_t>();
  }
  std::string text(const char* key) const {
    const Json& value = member(json_, key);
    if (!value.is_string() || value == "") refuse(where_, std::string(key) + " is not a name");
    return value;
  }
  bool boolean(const char* key) const {
    const Json& value = member(json_, key);
    if (!value.is_boolean()) refuse(where_, std::string(key) + " is neither true nor false");
    return value;
  }
  Eigen::Vector3d vector(const Json& parent, const char* key) const {
    const Json& value = member(parent, key);
    const auto isNumber = [](const Json& one) { return one.is_number(); };
    if (!value.is_array() || value.size() != 3 || !std::ranges::all_of(value, isNumber)) {
      refuse(where_, std::string(key) + " has not 3 numbers");
    }
    return Eigen::Vector3d(value[0].get<double>(), value[1].get<double>(), value[2].get<double>());
  }
  std::vector<TruthKey> keys() const {
    const Json& list = member(json_, "keys");
    if (!list.is_array() || list.empty()) refuse(where_, "keys is not a list with at least one");
    std::vector<TruthKey> keys;
    for (const Json& item : list) {
      if (!item.is_object()) refuse(where_, "a key is not an object");
      const Json& yaw = member(item, "yaw");
      if (!yaw.is_number()) refuse(where_, "yaw is not a number");
      keys.push_back(
          {fromNanoseconds(integer(item, "time_ns")), vector(item, "centre"), yaw.get<double>()});
      if (keys.size() > 1 && keys.back().time <= keys[keys.size() - 2].time) {
        refuse(where_, "keys are not in the order of time");
      }
    }
    return keys;
  }

  const Json& json_;
  std::string where_;
};

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
    objects.push_back(ObjectReader(item, where).read());
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

/// Adds the boxes inside the image. Folders of earlier versions lack this file.
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
