// Loggers of phones that write tables: MARS Logger (Huai et al. 2019), OpenCamera Sensors, Sensor
// Logger, and ios_logger. Columns and units are those that their documentation gives.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <iterator>
#include <map>

#include "common/base/algorithms/folder.h"
#include "common/base/errors.h"
#include "common/replay/files/image_folder.h"
#include "common/replay/files/stamps.h"
#include "common/replay/files/text_file.h"
#include "common/replay/phone/parts.h"
#include "common/replay/sensor_table.h"

namespace perdure::replay::phone {
namespace {

namespace fs = std::filesystem;
using Texts = std::vector<std::string_view>;

constexpr double kGravity = 9.80665;  ///< m/s², the unit g of phones
/// CoreMotion measures the direction of gravity, not of the specific force, and in g.
constexpr double kIosForce = -kGravity;

fs::path firstOf(const fs::path& folder, std::initializer_list<const char*> names) {
  for (const char* name : names) {
    if (fs::exists(folder / name)) return folder / name;
  }
  return {};
}

/// The first line of a table, if it names the columns; in lower case.
std::vector<std::string> headOf(const fs::path& file) {
  std::ifstream lines(file);
  std::string line;
  std::getline(lines, line);
  std::vector<std::string> head;
  const std::string lower = toLower(trim(line));
  const std::string_view names = std::string_view(lower).substr(lower.starts_with('#') ? 1 : 0);
  if (!isHeader(fieldsOf(trim(names)))) return head;
  for (const auto field : fieldsOf(trim(names))) head.emplace_back(field);
  return head;
}

/// The unit that a column's name gives in brackets; "" if there is none.
std::string unitIn(const std::string& name) {
  const auto open = name.find_first_of("[("), close = name.find_last_of("])");
  if (open == name.npos || close == name.npos || close < open) return {};
  return name.substr(open + 1, close - open - 1);
}

/// The factor from the unit in a column's name to rad/s or m/s².
double scaleOf(const fs::path& file, const std::vector<std::string>& head, std::size_t column) {
  static const std::map<std::string, double> kUnits{
      {"", 1.0},       {"rad/s", 1.0},          {"rad s^-1", 1.0},
      {"m/s^2", 1.0},  {"m/s2", 1.0},           {"m/s²", 1.0},
      {"m s^-2", 1.0}, {"deg/s", M_PI / 180.0}, {"dps", M_PI / 180.0},
      {"g", kGravity}, {"g-units", kGravity}};
  const std::string unit = column < head.size() ? unitIn(head[column]) : "";
  const auto known = kUnits.find(unit);
  if (known != kUnits.end()) return known->second;
  throw StartupError(ExitCode::kData,
                     "{}:1: the unit of `{}` is not known; known are rad/s and deg/s, m/s^2 and g: "
                     "convert the column and correct its name",
                     file.string(), head[column]);
}

/// Where a table has its values, counted after the stamp was moved to the front.
struct Columns {
  std::array<std::size_t, 3> at{1, 2, 3};
  double scale = 1.0;
};

std::string judgeColumns(const Texts& fields, const std::vector<Columns>& streams) {
  for (const Columns& columns : streams) {
    for (const std::size_t column : columns.at) {
      if (column >= fields.size()) {
        return fmt::format("{} columns, but {} are awaited", fields.size(), column + 1);
      }
      if (!parseNumber(fields[column])) {
        return fmt::format("`{}` is not a number", fields[column]);
      }
    }
  }
  return {};
}

/// Reads one stream for each of `streams`, which are columns of one table.
std::vector<Stream> readStreams(const fs::path& file, const std::string& kind,
                                const std::vector<Columns>& streams, Recording& recording,
                                StampColumn stamp = {}) {
  const SensorTable table(
      file, kind, recording, [&](const Texts& fields) { return judgeColumns(fields, streams); },
      stamp);
  std::vector<Stream> read(streams.size());
  for (const TableRow& row : table.rows()) {
    for (std::size_t i = 0; i < streams.size(); ++i) {
      Eigen::Vector3d value;
      for (int axis = 0; axis < 3; ++axis) {
        value[axis] = *parseNumber(row.fields[streams[i].at[static_cast<std::size_t>(axis)]]);
      }
      read[i].push_back({row.time, streams[i].scale * value});
    }
  }
  return read;
}

Stream readStream(const fs::path& file, const std::string& kind, const Columns& columns,
                  Recording& recording, StampColumn stamp = {}) {
  return readStreams(file, kind, {columns}, recording, stamp).front();
}

/// Reads stamps from the first column; entries are in the order of the film.
void readFrameList(const fs::path& file, PhoneCamera& camera, Recording& recording,
                   bool seconds = false) {
  const SensorTable table(file, "frame", recording, [](const Texts&) { return std::string(); },
                          {.last = false, .seconds = seconds});
  if (table.rows().empty()) {
    throw StartupError(ExitCode::kData, "{} has no stamp of a frame; copy it again", file.string());
  }
  for (const TableRow& row : table.rows()) camera.frames.push_back({row.time, row.number});
  camera.listed = table.lines();
}

/// Reads the focal lengths (px) in a column.
std::vector<double> readFocals(const fs::path& file, std::size_t column) {
  std::vector<double> focals;
  for (const TextLine& line : readLines(file, "it has the focal lengths")) {
    const Texts fields = fieldsOf(line.text);
    const auto focal = column < fields.size() ? parseNumber(fields[column]) : std::nullopt;
    if (focal && *focal > 0.0) focals.push_back(*focal);
  }
  return focals;
}

// MARS Logger, Android and iOS

bool looksLikeMars(const fs::path& folder) { return fs::exists(folder / "gyro_accel.csv"); }

Parts readMars(const fs::path& folder, Recording& recording) {
  Parts parts;
  const fs::path imu = folder / "gyro_accel.csv";
  parts.where = imu.string();
  const auto head = headOf(imu);
  auto streams = readStreams(
      imu, "imu", {{{1, 2, 3}, scaleOf(imu, head, 1)}, {{4, 5, 6}, scaleOf(imu, head, 4)}},
      recording);
  parts.gyro = std::move(streams[0]), parts.accel = std::move(streams[1]);
  PhoneCamera camera;
  camera.film = filmNamed(folder, "movie");
  if (camera.film.empty()) camera.film = folder / "movie.mp4";
  // In Android's metadata, some frames of the film are missing; iOS has no other list.
  const fs::path metadata = folder / "movie_metadata.csv";
  const fs::path list = firstOf(folder, {"frame_timestamps.txt", "frame_timestamps.csv"});
  readFrameList(list.empty() ? metadata : list, camera, recording);
  if (fs::exists(metadata)) camera.focal_px = readFocals(metadata, 1);
  parts.cameras.push_back(std::move(camera));
  return parts;
}

// A film with tables of gyroscope and accelerometer: OpenCamera Sensors

/// The tables whose names end with `of`, such as VID_2021_gyro.csv.
std::vector<fs::path> tablesOf(const fs::path& folder, const std::string& of) {
  return pathsIn(folder, [&](const fs::path& file) {
    const std::string name = toLower(file.filename().string());
    return name.ends_with(of + ".csv") || name.ends_with(of + ".txt");
  });
}

/// The common start of a recording's file names: that of its gyroscope without `_gyro.csv`.
std::string nameOfFilm(const fs::path& gyro) {
  std::string stem = gyro.stem().string();
  stem.resize(stem.size() - std::string_view("gyro").size());
  if (stem.ends_with('_')) stem.pop_back();
  return stem;
}

/// OpenCamera Sensors writes x, y, z, stamp without a head; others write the stamp first.
StampColumn stampOf(const fs::path& file) {
  const auto head = headOf(file);
  if (!head.empty()) return {.last = head.front().find("time") == std::string::npos};
  std::ifstream lines(file);
  std::string line;
  std::getline(lines, line);
  const Texts fields = fieldsOf(trim(line));
  if (fields.empty()) return {};
  const auto sizeOf = [](std::string_view field) {
    return std::abs(parseNumber(field).value_or(0.0));
  };
  return {.last = sizeOf(fields.back()) > sizeOf(fields.front())};  // stamps are large
}

/// The one table of a kind that belongs to the recording NAME.
fs::path tableOf(const fs::path& folder, const std::string& name, const std::string& of) {
  for (const fs::path& file : tablesOf(folder, of)) {
    if (file.stem().string().starts_with(name)) return file;
  }
  return {};
}

Stream readTable(const fs::path& file, const std::string& kind, Recording& recording) {
  const auto head = headOf(file);
  const StampColumn stamp = stampOf(file);
  return readStream(file, kind, {{1, 2, 3}, scaleOf(file, head, stamp.last ? 0 : 1)}, recording,
                    stamp);
}

bool looksLikeFilmWithTables(const fs::path& folder) {
  return !tablesOf(folder, "gyro").empty() && !tablesOf(folder, "accel").empty();
}

/// OpenCamera Sensors writes the tables into a folder beside the film.
fs::path filmOf(const fs::path& folder, const std::string& name) {
  const fs::path above = fs::absolute(folder / "").lexically_normal().parent_path().parent_path();
  for (const fs::path& place : {folder, above}) {
    const fs::path film = filmNamed(place, name);
    if (!film.empty()) return film;
  }
  const fs::path only = onlyFilm(folder);
  return only.empty() ? folder / ((name.empty() ? "video" : name) + ".mp4") : only;
}

Parts readFilmWithTables(const fs::path& folder, Recording& recording) {
  const auto gyros = tablesOf(folder, "gyro");
  if (gyros.size() > 1) {
    throw StartupError(
        ExitCode::kData, "{} has {} recordings, {} and {} among them: move each into a folder",
        folder.string(), gyros.size(), gyros[0].filename().string(), gyros[1].filename().string());
  }
  const std::string name = nameOfFilm(gyros.front());
  Parts parts;
  parts.where = gyros.front().string();
  parts.gyro = readTable(gyros.front(), "imu", recording);
  const fs::path accel = tableOf(folder, name, "accel");
  parts.accel =
      readTable(accel.empty() ? tablesOf(folder, "accel").front() : accel, "accel", recording);
  PhoneCamera camera;
  camera.film = filmOf(folder, name);
  const fs::path list = tableOf(folder, name, "timestamps");
  if (list.empty()) {
    throwMissing(folder / (name + (name.empty() ? "" : "_") + "timestamps.csv"),
                 "the list of the film's stamps", "copy it too; it has one line for each frame");
  }
  readFrameList(list, camera, recording);
  parts.cameras.push_back(std::move(camera));
  return parts;
}

// Sensor Logger

bool looksLikeSensorLogger(const fs::path& folder) { return fs::exists(folder / "Gyroscope.csv"); }

/// Sensor Logger names its columns; it writes z, y, x.
Stream readNamed(const fs::path& file, const std::string& kind, double scale,
                 Recording& recording) {
  const auto head = headOf(file);
  Columns columns{.scale = scale};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::string name(1, "xyz"[axis]);
    const auto found = std::find(head.begin(), head.end(), name);
    if (found == head.end()) {
      throw StartupError(ExitCode::kData, "{}:1: no column is named {}; export the recording again",
                         file.string(), name);
    }
    columns.at[axis] = static_cast<std::size_t>(found - head.begin());
  }
  return readStream(file, kind, columns, recording);
}

/// Value of a column in the second line of Metadata.csv; "" if it is missing.
std::string metadataOf(const fs::path& folder, const std::string& column) {
  const fs::path file = firstOf(folder, {"Metadata.csv", "metadata.csv"});
  if (file.empty()) return {};
  const auto lines = readLines(file, "it names the phone");
  if (lines.size() < 2) return {};
  const Texts head = fieldsOf(lines[0].text), values = split(lines[1].text, ',');
  const auto found = std::find(head.begin(), head.end(), column);
  const auto index = static_cast<std::size_t>(found - head.begin());
  return index < values.size() ? toLower(values[index]) : "";
}

/// The sign of accelerations: iOS measures towards gravity, unless the app standardises.
double signOfForce(const fs::path& folder) {
  const std::string platform = metadataOf(folder, "platform");
  if (platform.empty()) {
    throw StartupError(ExitCode::kUnavailable,
                       "Metadata.csv is missing in {}, or names no platform: iOS and Android give "
                       "accelerations of opposite sign; export it with the recording",
                       folder.string());
  }
  return platform == "ios" && metadataOf(folder, "standardisation") != "true" ? -1.0 : 1.0;
}

/// The specific force: as recorded, or as the sum of acceleration and gravity.
Stream readForce(const fs::path& folder, Recording& recording) {
  const double sign = signOfForce(folder);
  const fs::path whole = folder / "TotalAcceleration.csv", gravity = folder / "Gravity.csv";
  if (fs::exists(whole)) return readNamed(whole, "accel", sign, recording);
  const fs::path motion = folder / "Accelerometer.csv";
  if (!fs::exists(motion) || !fs::exists(gravity)) {
    throw StartupError(ExitCode::kData,
                       "{} has no acceleration with gravity: Sensor Logger's Accelerometer.csv is "
                       "without it; record Gravity too (iOS), or TotalAcceleration (Android)",
                       folder.string());
  }
  Stream force = readNamed(motion, "accel", sign, recording);
  const Stream pull = readNamed(gravity, "accel", sign, recording);
  const Duration widest = widestOf(pull);
  std::erase_if(force, [&](Reading& reading) {
    const auto value = valueAt(pull, reading.time, widest);
    if (value) reading.value += *value;
    return !value;
  });
  return force;
}

/// The time in a file's name, in milliseconds since 1970.
std::optional<TimePoint> timeInName(const fs::path& file) {
  constexpr std::int64_t kMost_ms = 4'000'000'000'000;  // the year 2096
  const auto ms = parseInteger(file.stem().string());
  if (!ms || *ms < 0 || *ms > kMost_ms) return std::nullopt;
  return fromNanoseconds(*ms * 1'000'000);
}

PhoneCamera cameraOfSensorLogger(const fs::path& folder, Recording& recording) {
  PhoneCamera camera;
  camera.film = onlyFilm(folder);
  if (!camera.film.empty()) {
    const auto start = timeInName(camera.film);
    if (!start) {
      throw StartupError(ExitCode::kData,
                         "{}: its name is not the time of its first frame in milliseconds, which "
                         "Sensor Logger gives it; name it so",
                         camera.film.string());
    }
    camera.film_start = *start;
    recording.notes.push_back(
        camera.film.string() +
        ": its frames have the times in the film after that in its name, to some 10 ms; `perdure "
        "calibrate from-motion` finds the rest as time_offset_s");
    return camera;
  }
  for (const fs::path& image : pathsIn(folder, isImageName)) {
    const auto time = timeInName(image);
    if (time) camera.frames.push_back({*time, camera.frames.size(), image.string()});
  }
  camera.listed = camera.frames.size();
  if (camera.listed > 0) return camera;
  throwMissing(folder / "1700000000000.mp4", "the film (one only) or any image",
               "Sensor Logger names them by their time in milliseconds; export the camera too");
}

Parts readSensorLogger(const fs::path& folder, Recording& recording) {
  Parts parts;
  parts.where = (folder / "Gyroscope.csv").string();
  parts.gyro = readNamed(parts.where, "imu", 1.0, recording);
  parts.accel = readForce(folder, recording);
  parts.cameras.push_back(cameraOfSensorLogger(folder / "Camera", recording));
  return parts;
}

// ios_logger (ARKit)

bool looksLikeIosLogger(const fs::path& folder) {
  return fs::exists(folder / "Gyro.txt") && fs::exists(folder / "Frames.txt");
}

Parts readIosLogger(const fs::path& folder, Recording& recording) {
  constexpr StampColumn kSeconds{.last = false, .seconds = true};
  Parts parts;
  parts.where = (folder / "Gyro.txt").string();
  parts.gyro = readStream(folder / "Gyro.txt", "imu", {}, recording, kSeconds);
  if (!fs::exists(folder / "Accel.txt")) {
    throwMissing(folder / "Accel.txt", "the accelerometer", "switch it on in the app");
  }
  parts.accel =
      readStream(folder / "Accel.txt", "accel", {.scale = kIosForce}, recording, kSeconds);
  PhoneCamera camera;
  camera.film = filmNamed(folder, "Frames");
  if (camera.film.empty()) camera.film = folder / "Frames.m4v";
  readFrameList(folder / "Frames.txt", camera, recording, true);
  camera.focal_px = readFocals(folder / "Frames.txt", 2);
  parts.cameras.push_back(std::move(camera));
  return parts;
}

}  // namespace

const Format kMarsLogger{looksLikeMars, readMars};
const Format kFilmWithTables{looksLikeFilmWithTables, readFilmWithTables};
const Format kSensorLogger{looksLikeSensorLogger, readSensorLogger};
const Format kIosLogger{looksLikeIosLogger, readIosLogger};

}  // namespace perdure::replay::phone
