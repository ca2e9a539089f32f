#include "common/replay/files/pose_columns.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/replay/files/text_file.h"

namespace perdure::replay {
namespace {

constexpr std::size_t kTime = 0, kX = 1, kQx = 4;

/// The name without unit, quotes and comment signs.
std::string plainName(std::string_view name) {
  std::string plain = toLower(trim(name.substr(0, name.find_first_of("[("))));
  std::erase_if(plain, [](char c) { return c == '"' || c == '\'' || c == '#' || c == '%'; });
  return plain;
}

bool isOneOf(std::string_view name, std::initializer_list<std::string_view> names) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

bool isTime(const std::string& name) {
  return isOneOf(name, {"t", "time", "timestamp", "stamp", "timestamps", "time_s", "t_s",
                        "timestamp_ns", "time_ns", "t_ns", "stamp_ns"});
}

/// Returns the index of a name in t x y z qx qy qz qw. Returns nothing for other names.
std::optional<std::size_t> columnOf(const std::string& name) {
  if (isTime(name)) return kTime;
  constexpr std::string_view kAxes = "xyzw";
  if (name.empty() || kAxes.find(name.back()) == kAxes.npos) return std::nullopt;
  const std::size_t axis = kAxes.find(name.back());
  std::string before = name.substr(0, name.size() - 1);
  while (before.ends_with('_') || before.ends_with('.')) before.pop_back();
  const std::string last = before.substr(before.find_last_of('.') + 1);
  if (isOneOf(last, {"q", "orientation", "rotation", "quaternion", "quat", "rot"}) ||
      before.starts_with("q_")) {
    return kQx + axis;
  }
  const bool place = isOneOf(last, {"", "t", "p", "position", "translation", "pos", "trans"});
  if (axis < 3 && (place || before.starts_with("p_"))) return kX + axis;
  return std::nullopt;
}

}  // namespace

std::optional<PoseColumns> poseColumnsOf(const std::vector<std::string_view>& names) {
  PoseColumns columns;
  columns.count = names.size();
  std::array<bool, 8> named{};
  std::optional<std::size_t> header_stamp;
  bool euroc = false;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const std::string name = plainName(names[i]);
    if (name.ends_with("header.stamp")) {
      if (header_stamp) return std::nullopt;
      header_stamp = i;
      continue;
    }
    const auto column = columnOf(name);
    if (!column) continue;
    if (std::exchange(named[*column], true)) return std::nullopt;
    columns.of[*column] = i;
    euroc = euroc || name.starts_with("p_rs_") ||
            (*column == kTime && (name.ends_with("_ns") || names[i].find("[ns]") != names[i].npos));
  }
  if (header_stamp) columns.of[kTime] = *header_stamp, named[kTime] = true;
  if (!std::all_of(named.begin(), named.end(), [](bool is) { return is; })) return std::nullopt;
  columns.nanoseconds = euroc || header_stamp;
  return columns;
}

bool namesAngles(const std::vector<std::string_view>& names) {
  bool angles = false, quaternion = false, time = false;  // all remain false for a comment in prose
  for (const auto& written : names) {
    std::string name = plainName(written);
    time = time || isTime(name) || name.ends_with("stamp");
    for (const std::string_view unit : {"_deg", "_rad", "_degrees", "_radians"}) {
      if (name.ends_with(unit)) name.resize(name.size() - unit.size());
    }
    for (const std::string_view angle : {"roll", "pitch", "yaw", "heading"}) {
      angles = angles || name == angle || name.ends_with("." + std::string(angle)) ||
               name.ends_with("_" + std::string(angle));
    }
    const auto column = columnOf(name);
    quaternion = quaternion || (column && *column >= kQx);
  }
  return angles && time && !quaternion;
}

std::string otherKindOfPoses(std::string_view line, const std::vector<std::string_view>& fields) {
  if (line.starts_with('[') || line.starts_with('{')) {
    return "this is JSON, or has brackets; write lines t x y z qx qy qz qw";
  }
  constexpr const char* kColmap =
      "this is COLMAP's images.txt: its poses are the world in the camera and have no times; write "
      "lines t x y z qx qy qz qw of the body in the world, which is (T_CW)^-1 times the inverse of "
      "T_BS, with the time of each image and in metres";
  if (line.starts_with('#') && line.find("IMAGE_ID") != line.npos && line.find("QW") != line.npos) {
    return kColmap;
  }
  constexpr std::size_t kColumns = 10;
  if (fields.size() != kColumns) return "";
  const auto numbers = parseNumbers({fields.begin(), fields.end() - 1});
  const std::string name = toLower(fields.back());
  if (!numbers || (!name.ends_with(".png") && !name.ends_with(".jpg") && !name.ends_with(".jpeg")))
    return "";
  const auto& v = *numbers;
  const double norm = std::sqrt(v[1] * v[1] + v[2] * v[2] + v[3] * v[3] + v[4] * v[4]);
  return std::abs(norm - 1.0) < 1e-2 ? kColmap : "";
}

}  // namespace perdure::replay
