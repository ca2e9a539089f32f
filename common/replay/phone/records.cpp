// Loggers of phones that write JSON, one record after another: Spectacular AI's data.jsonl, and
// loggers of Android's sensor events (sensorType, timestamp in nanoseconds, values).
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "common/base/algorithms/folder.h"
#include "common/base/errors.h"
#include "common/replay/files/sensor_file.h"
#include "common/replay/files/stamps.h"
#include "common/replay/files/text_file.h"
#include "common/replay/phone/parts.h"

namespace perdure::replay::phone {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

struct RecordText {
  std::size_t line = 0;  ///< number of its first line, from 1
  std::string_view text;
};

/// The end of the object that begins at `at`, or npos if it is not whole.
std::size_t endOfObject(std::string_view text, std::size_t at) {
  int depth = 0;
  bool quoted = false;
  for (; at < text.size(); ++at) {
    const char c = text[at];
    if (quoted && c == '\\') {
      ++at;
    } else if (c == '"') {
      quoted = !quoted;
    } else if (!quoted && c == '{') {
      ++depth;
    } else if (!quoted && c == '}' && --depth == 0) {
      return at + 1;
    }
  }
  return text.npos;
}

/// The objects in a text: one a line, over several lines, or in one array. A record that is cut off
/// ends the list and is not whole.
std::vector<RecordText> recordsIn(std::string_view text) {
  std::vector<RecordText> records;
  std::size_t line = 1, counted = 0;
  for (std::size_t at = text.find('{'); at != text.npos;) {
    line +=
        static_cast<std::size_t>(std::count(text.begin() + static_cast<std::ptrdiff_t>(counted),
                                            text.begin() + static_cast<std::ptrdiff_t>(at), '\n'));
    counted = at;
    const std::size_t end = endOfObject(text, at);
    records.push_back({line, text.substr(at, end == text.npos ? end : end - at)});
    at = end == text.npos ? end : text.find('{', end);
  }
  return records;
}

std::string textOfFile(const fs::path& file, std::streamsize most = 0) {
  refuseUnreadable(file);
  std::ifstream stream(file, std::ios::binary);
  if (most == 0) return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  std::string text(static_cast<std::size_t>(most), '\0');
  stream.read(text.data(), most);
  text.resize(static_cast<std::size_t>(stream.gcount()));
  return text;
}

/// Takes a record; returns the reason why it cannot be used, or "".
using Take = std::function<std::string(const Json& record)>;

/// Reads all records of a file. A few that cannot be used are counted (record_malformed) and noted;
/// if it is over half of them, the first is the error.
void readRecords(const fs::path& file, Recording& recording, const Take& take) {
  const std::string text = textOfFile(file);
  const auto records = recordsIn(text);
  if (records.empty()) {
    throw StartupError(ExitCode::kData, "{} has no record; copy it again, or record again",
                       file.string());
  }
  std::size_t wrong = 0;
  std::string first;
  for (const RecordText& record : records) {
    const Json parsed = Json::parse(record.text, nullptr, false);
    std::string why = "not a whole record of JSON";
    try {
      if (!parsed.is_discarded()) why = take(parsed);
    } catch (const Json::exception& error) {  // a value of another type than awaited
      why = error.what();
    }
    if (why.empty()) continue;
    if (wrong++ == 0) first = fmt::format("{}:{}: {}", file.string(), record.line, why);
  }
  if (wrong == 0) return;
  if (2 * wrong > records.size()) {
    throw StartupError(ExitCode::kData, "{}; so are {} more of {} records", first, wrong - 1,
                       records.size());
  }
  recording.reasons.add("record_malformed", wrong);
  recording.notes.push_back(
      fmt::format("{}: {} of {} records cannot be read and were left out; the first: {}",
                  file.string(), wrong, records.size(), first));
}

/// A number, also as text (Sensor Logger writes "0.25").
std::optional<double> numberOf(const Json& value) {
  if (value.is_string()) return parseNumber(value.get_ref<const std::string&>());
  if (!value.is_number()) return std::nullopt;
  const double number = value.get<double>();
  return std::isfinite(number) ? std::optional(number) : std::nullopt;
}

/// Three numbers of a list, or x, y, z of an object.
std::optional<Eigen::Vector3d> vectorOf(const Json& values) {
  Eigen::Vector3d vector;
  for (int i = 0; i < 3; ++i) {
    const auto index = static_cast<std::size_t>(i);
    const std::string name(1, "xyz"[index]);
    const bool listed = values.is_array() && index < values.size();
    if (!listed && !(values.is_object() && values.contains(name))) return std::nullopt;
    const auto number = numberOf(listed ? values[index] : values[name]);
    if (!number) return std::nullopt;
    vector[i] = *number;
  }
  return vector;
}

constexpr char kNoVector[] = "the values are not three numbers";

/// The first of several keys that a record has; null if it has none.
const Json& valueOf(const Json& record, std::initializer_list<const char*> keys) {
  static const Json kNull;
  for (const char* key : keys) {
    if (record.contains(key)) return record[key];
  }
  return kNull;
}

/// Orders the streams, and the frames of each camera.
void orderParts(Parts& parts, Recording& recording) {
  orderByTime(parts.gyro, "imu", parts.where, recording);
  orderByTime(parts.accel, "accel", parts.where, recording);
  for (std::size_t i = 0; i < parts.cameras.size(); ++i) {
    orderByTime(parts.cameras[i].frames, i == 0 ? "frame" : "stereo", parts.where, recording);
  }
}

// Spectacular AI

constexpr std::size_t kCameras = 2;

/// The distortion by OpenCV's coefficients.
void setDistortion(const SensorFile& file, CameraCalibration& camera) {
  const char* key = file.has("model") ? "model" : "distortionModel";
  std::string model = file.has(key) ? toLower(file.text(key)) : "pinhole";
  std::replace(model.begin(), model.end(), '_', '-');
  const auto k = file.list("distortionCoefficients").value_or(std::vector<double>());
  if (k.empty()) return;
  if (model == "kannala-brandt4" && k.size() == 4) {
    camera.distortion = DistortionModel::kEquidistant, camera.distortion_coefficients = k;
  } else if (model == "pinhole" && k.size() == 3) {  // k1, k2, k3
    camera.distortion = DistortionModel::kRational;
    camera.distortion_coefficients = {k[0], k[1], 0.0, 0.0, k[2], 0.0, 0.0, 0.0};
  } else if (model == "brown-conrady" && k.size() >= 4 && k.size() <= 8) {
    camera.distortion =
        k.size() == 4 ? DistortionModel::kRadialTangential : DistortionModel::kRational;
    camera.distortion_coefficients = k;
    camera.distortion_coefficients.resize(k.size() == 4 ? 4 : 8, 0.0);
  } else {
    file.wrong("model", fmt::format("is {} with {} coefficients; known are pinhole (none or 3), "
                                    "kannala-brandt4 and brown-conrady (4 … 8): give a rig file "
                                    "with --rig",
                                    model, k.size()));
  }
}

/// A camera of calibration.json, or of a frame's cameraParameters. imuToCamera is T_CB.
CameraCalibration cameraOf(const SensorFile& lens, const SensorFile& pose) {
  CameraCalibration camera;
  const auto size = [&](const char* key) {
    return static_cast<std::uint32_t>(lens.number(key, 0.0, 0.0));
  };
  camera.width = size("imageWidth"), camera.height = size("imageHeight");
  camera.fx = lens.number("focalLengthX", 1.0), camera.fy = lens.number("focalLengthY", 1.0);
  camera.cx = lens.number("principalPointX", 0.0), camera.cy = lens.number("principalPointY", 0.0);
  setDistortion(lens, camera);
  const char* key = pose.has("imuToCamera") ? "imuToCamera" : "imuToCameraMatrix";
  const auto T_CB = pose.transform(key);
  if (!T_CB) pose.wrong("imuToCamera", "is missing; give a rig file with --rig");
  camera.T_BC = T_CB->inverse();
  return camera;
}

std::optional<CameraCalibration> calibrationIn(const fs::path& file, std::size_t index) {
  if (!fs::exists(file)) return std::nullopt;
  const SensorFile whole(file);
  const YAML::Node cameras = whole.root()["cameras"];
  if (!cameras || !cameras.IsSequence()) whole.wrong("cameras", "is missing or no list");
  if (index >= cameras.size()) return std::nullopt;
  const SensorFile camera(file.string(), cameras[index]);
  return cameraOf(camera, camera);
}

class SpectacularReader {
 public:
  SpectacularReader(const fs::path& folder, Recording& recording)
      : folder_(folder), recording_(recording) {}

  Parts read() {
    parts_.where = (folder_ / "data.jsonl").string();
    for (std::size_t i = 0; i < kCameras; ++i) calibrations_[i] = calibration(i);
    readRecords(parts_.where, recording_, [&](const Json& record) { return take(record); });
    shiftNegative();
    addCameras();
    orderParts(parts_, recording_);
    return std::move(parts_);
  }

 private:
  std::optional<CameraCalibration> calibration(std::size_t index) const {
    return calibrationIn(folder_ / "calibration.json", index);
  }

  std::string take(const Json& record) {
    const Json& sensor = valueOf(record, {"sensor"});
    const Json& frames = valueOf(record, {"frames"});
    if (!sensor.is_object() && !frames.is_array()) return {};  // GNSS, poses, metadata
    const auto seconds = numberOf(valueOf(record, {"time"}));
    constexpr double kMost_s = 4e9;  // the year 2096
    if (!seconds || std::abs(*seconds) > kMost_s)
      return "`time` is missing or no number of seconds";
    const TimePoint time(durationFromSeconds(*seconds));
    return sensor.is_object() ? takeSensor(sensor, time) : takeFrames(frames, time);
  }

  std::string takeSensor(const Json& sensor, TimePoint time) {
    const std::string type = sensor.value("type", "");
    if (type != "gyroscope" && type != "accelerometer") return {};
    const auto value = vectorOf(valueOf(sensor, {"values"}));
    if (!value) return kNoVector;
    (type == "gyroscope" ? parts_.gyro : parts_.accel).push_back({time, *value});
    return {};
  }

  std::string takeFrames(const Json& frames, TimePoint time) {
    for (const Json& frame : frames) {
      const auto index = frame.at("cameraInd").get<std::size_t>();
      if (index >= kCameras || frame.value("missingBitmap", false)) continue;
      if (!calibrations_[index]) calibrations_[index] = calibrationOf(frame);
      frames_[index].push_back({time, frames_[index].size()});
    }
    return {};
  }

  /// The calibration in a frame, for recordings without calibration.json.
  std::optional<CameraCalibration> calibrationOf(const Json& frame) const {
    if (!frame.contains("cameraParameters") || !frame.contains("imuToCamera")) return std::nullopt;
    return cameraOf(SensorFile(parts_.where, YAML::Load(frame["cameraParameters"].dump())),
                    SensorFile(parts_.where, YAML::Load(frame.dump())));
  }

  /// Stamps may begin at any number; those of Perdure are not negative.
  void shiftNegative() {
    TimePoint first;
    for (const Stream& stream : {parts_.gyro, parts_.accel}) {
      for (const Reading& reading : stream) first = std::min(first, reading.time);
    }
    for (const auto& frames : frames_) {
      for (const ListedFrame& frame : frames) first = std::min(first, frame.time);
    }
    if (first >= TimePoint{}) return;
    const Duration added = std::chrono::ceil<std::chrono::seconds>(-first.time_since_epoch());
    for (Stream* stream : {&parts_.gyro, &parts_.accel}) {
      for (Reading& reading : *stream) reading.time += added;
    }
    for (auto& frames : frames_) {
      for (ListedFrame& frame : frames) frame.time += added;
    }
    recording_.notes.push_back(fmt::format(
        "{}: its stamps begin below 0; {:.0f} s are added to all", parts_.where, toSeconds(added)));
  }

  /// Adds the first camera, and the second one if it is an image with a calibration.
  void addCameras() {
    if (frames_[0].empty()) {
      throw StartupError(ExitCode::kData, "{} has no frame of camera 0; record the camera too",
                         parts_.where);
    }
    for (std::size_t i = 0; i < kCameras; ++i) {
      PhoneCamera camera;
      const std::string stem = i == 0 ? "data" : "data2";
      camera.film = filmNamed(folder_, stem);
      if (i > 0 && (camera.film.empty() || frames_[i].empty() || !calibrations_[i])) continue;
      if (camera.film.empty() && !fs::is_directory(folder_ / "frames")) {
        camera.film = folder_ / (stem + ".mp4");
      }
      camera.listed = frames_[i].size();
      camera.frames = std::move(frames_[i]);
      for (ListedFrame& frame : camera.frames) {
        if (!camera.film.empty()) break;
        frame.image = imageOf(frame.number);
      }
      camera.calibration = calibrations_[i];
      parts_.cameras.push_back(std::move(camera));
    }
  }

  /// frames/00000012.png or frames/12.png, by the number of the frame.
  std::string imageOf(std::size_t number) const {
    for (const char* format : {"{:08}", "{:06}", "{:05}", "{}"}) {
      const fs::path image =
          imagePath(folder_ / "frames", fmt::format(fmt::runtime(format), number));
      if (fs::exists(image)) return image.string();
    }
    return (folder_ / "frames" / fmt::format("{:08}.png", number)).string();
  }

  fs::path folder_;
  Recording& recording_;
  Parts parts_;
  std::array<std::vector<ListedFrame>, kCameras> frames_;
  std::array<std::optional<CameraCalibration>, kCameras> calibrations_;
};

bool looksLikeSpectacular(const fs::path& folder) { return fs::exists(folder / "data.jsonl"); }

Parts readSpectacular(const fs::path& folder, Recording& recording) {
  return SpectacularReader(folder, recording).read();
}

// Records of sensor events

enum class Event { kGyro, kAccel, kWithoutGravity, kOther };

/// The kind of a sensor, by its name or by Android's number.
Event eventOf(const Json& type) {
  if (type.is_number()) {
    constexpr std::pair<int, Event> kNumbers[] = {
        {1, Event::kAccel}, {4, Event::kGyro}, {10, Event::kWithoutGravity}};
    for (const auto& [number, event] : kNumbers) {
      if (type == number) return event;
    }
    return Event::kOther;
  }
  const std::string name = type.is_string() ? toLower(type.get<std::string>()) : "";
  const auto has = [&](const char* part) { return name.find(part) != name.npos; };
  if (has("uncal")) return Event::kOther;
  if (has("gyro")) return Event::kGyro;
  if (has("linear") || has("user")) return Event::kWithoutGravity;
  return has("accel") ? Event::kAccel : Event::kOther;
}

const Json& typeOf(const Json& record) {
  return valueOf(record, {"sensorType", "sensor_type", "sensor", "type"});
}
const Json& imageIn(const Json& record) {
  return valueOf(record, {"fileName", "filename", "file_name", "file", "image"});
}
const Json& stampIn(const Json& record) {
  return valueOf(record, {"timestamp", "timestamp_ns", "timestampNs", "time_ns", "time"});
}

/// The files of records, in the folder and in its folder `data`.
std::vector<fs::path> recordFiles(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const fs::path& place : {folder, folder / "data"}) {
    for (const fs::path& file : pathsIn(place, [](const fs::path& path) {
           const std::string ending = path.extension().string();
           return (ending == ".jsonl" || ending == ".json") && fs::is_regular_file(path);
         })) {
      const std::string text = textOfFile(file, 4096);
      const auto records = recordsIn(text);
      const Json first =
          records.empty() ? Json() : Json::parse(records.front().text, nullptr, false);
      if (!first.is_object() || stampIn(first).is_null()) continue;
      if (!typeOf(first).is_null() || !imageIn(first).is_null()) files.push_back(file);
    }
  }
  return files;
}

class EventReader {
 public:
  EventReader(const fs::path& folder, Recording& recording)
      : folder_(folder), recording_(recording) {}

  Parts read() {
    parts_.where = folder_.string();
    for (const fs::path& file : recordFiles(folder_)) {
      readRecords(file, recording_,
                  [&](const Json& record) { return take(record, file.parent_path()); });
    }
    if (parts_.accel.empty() && without_gravity_ > 0) {
      throw StartupError(ExitCode::kData,
                         "{} has only accelerations without gravity ({} records); record the "
                         "accelerometer itself (Android's sensor 1)",
                         parts_.where, without_gravity_);
    }
    if (camera_.frames.empty()) {
      throw StartupError(ExitCode::kData,
                         "{} has no record of a frame with the name of its image; record the "
                         "camera too",
                         parts_.where);
    }
    camera_.listed = camera_.frames.size();
    parts_.cameras.push_back(std::move(camera_));
    orderParts(parts_, recording_);
    return std::move(parts_);
  }

 private:
  std::string take(const Json& record, const fs::path& place) {
    const Json& image = imageIn(record);
    const Event event = eventOf(typeOf(record));
    if (event == Event::kWithoutGravity) ++without_gravity_;
    const bool is_frame = image.is_string();
    if (!is_frame && event != Event::kGyro && event != Event::kAccel) return {};
    const Json& stamp = stampIn(record);
    const std::string text = stamp.is_string() ? stamp.get<std::string>() : stamp.dump();
    const auto time = parseNanoseconds(text);
    if (!time) return whyNoStamp(text);
    if (is_frame) {
      const auto file = imageFile(image.get<std::string>(), place);
      camera_.frames.push_back({*time, camera_.frames.size(), file});
      return {};
    }
    const Json& values = valueOf(record, {"values", "value", "data"});
    const auto value = vectorOf(values.is_null() ? record : values);
    if (!value) return kNoVector;
    (event == Event::kGyro ? parts_.gyro : parts_.accel).push_back({*time, *value});
    return {};
  }

  /// The image beside its record, in the folder, or in `images` or `frames`.
  std::string imageFile(const std::string& name, const fs::path& place) const {
    for (const fs::path& folder :
         {folder_ / "images", folder_ / "frames", folder_, place, place / "images"}) {
      if (fs::exists(folder / name)) return (folder / name).string();
    }
    return (folder_ / "images" / name).string();
  }

  fs::path folder_;
  Recording& recording_;
  Parts parts_;
  PhoneCamera camera_;
  std::size_t without_gravity_ = 0;
};

bool looksLikeRecords(const fs::path& folder) { return !recordFiles(folder).empty(); }

Parts readEvents(const fs::path& folder, Recording& recording) {
  return EventReader(folder, recording).read();
}

}  // namespace

const Format kSpectacularAi{looksLikeSpectacular, readSpectacular};
const Format kJsonRecords{looksLikeRecords, readEvents};

}  // namespace perdure::replay::phone
