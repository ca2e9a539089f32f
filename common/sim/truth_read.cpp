#include <array>
#include <charconv>
#include <cmath>
#include <fstream>
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

/// One object of objects_truth.json; complaints say which and what.
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
    if (!value.is_string() || value.get_ref<const std::string&>().empty()) {
      refuse(where_, std::string(key) + " is not a name");
    }
    return value.get<std::string>();
  }
  bool boolean(const char* key) const {
    const Json& value = member(json_, key);
    if (!value.is_boolean()) refuse(where_, std::string(key) + " is neither true nor false");
    return value.get<bool>();
  }
  Eigen::Vector3d vector(const Json& parent, const char* key) const {
    const Json& value = member(parent, key);
    Eigen::Vector3d v;
    if (!value.is_array() || value.size() != 3)
      refuse(where_, std::string(key) + " has not 3 numbers");
    for (std::size_t i = 0; i < 3; ++i) {
      if (!value[i].is_number()) refuse(where_, std::string(key) + " has not 3 numbers");
      v[static_cast<Eigen::Index>(i)] = value[i].get<double>();
    }
    return v;
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

/// A row's frame and view; nothing where it is malformed.
std::optional<std::pair<std::uint64_t, TruthView>> parseRow(std::string_view line) {
  std::vector<std::string_view> fields;
  for (std::size_t begin = 0; begin <= line.size();) {
    const std::size_t end = std::min(line.find(',', begin), line.size());
    fields.push_back(line.substr(begin, end - begin));
    begin = end + 1;
  }
  if (fields.size() != 7) return std::nullopt;
  const auto frame = parse<std::uint64_t>(fields[0]), id = parse<std::uint64_t>(fields[1]);
  std::array<double, 5> numbers{};
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    const auto number = parse<double>(fields[i + 2]);
    if (!number || !std::isfinite(*number)) return std::nullopt;
    numbers[i] = *number;
  }
  if (!frame || !id) return std::nullopt;
  return {{*frame, {*id, numbers[0], Box{numbers[1], numbers[2], numbers[3], numbers[4]}}}};
}

std::map<std::uint64_t, std::vector<TruthView>> readViews(const fs::path& file,
                                                          const std::vector<TruthObject>& objects) {
  std::set<std::uint64_t> ids;
  for (const TruthObject& object : objects) ids.insert(object.id);
  std::ifstream stream = open(file);
  std::map<std::uint64_t, std::vector<TruthView>> views;
  std::set<std::pair<std::uint64_t, std::uint64_t>> seen;
  std::string line;
  std::size_t number = 1;
  for (; std::getline(stream, line); ++number) {
    const std::string where = file.string() + ":" + std::to_string(number);
    if (stream.eof()) refuse(where, "the file was cut within this line");
    if (line.ends_with('\r')) line.pop_back();
    if (number == 1) {
      if (line != kVisibilityHeader) {
        refuse(where, std::string("the header is not ") + kVisibilityHeader);
      }
      continue;
    }
    const auto row = parseRow(line);
    if (!row) refuse(where, "is not a row of seven finite numbers");
    const auto& [frame, view] = *row;
    if (!ids.contains(view.object_id)) refuse(where, "its object is not in objects_truth.json");
    if (view.visible_fraction < 0 || view.visible_fraction > 1) {
      refuse(where, "visible_fraction is not within 0 and 1");
    }
    if (view.box.x1 >= view.box.x2 || view.box.y1 >= view.box.y2) refuse(where, "its box is empty");
    if (!seen.insert({frame, view.object_id}).second)
      refuse(where, "the object was in this frame before");
    views[frame].push_back(view);
  }
  if (number == 1) refuse(file.string(), "is empty");
  return views;
}

}  // namespace

bool hasTruth(const fs::path& folder) { return fs::is_regular_file(folder / kObjectsTruthFile); }

Truth readTruth(const fs::path& folder) {
  Truth truth;
  truth.objects = readObjects(folder / kObjectsTruthFile);
  truth.views = readViews(folder / kVisibilityTruthFile, truth.objects);
  return truth;
}

}  // namespace perdure::sim
