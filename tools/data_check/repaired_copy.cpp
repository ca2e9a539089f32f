#include "tools/data_check/repaired_copy.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <map>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <set>
#include <span>

#include "common/base/checked_file.h"
#include "common/base/errors.h"
#include "common/replay/files/output_place.h"
#include "common/replay/files/sensor_file.h"
#include "tools/data_check/clock_shift.h"
#include "tools/data_check/data_check.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;
using replay::Recording;

constexpr double kGravity = 9.80665, kRadians = M_PI / 180.0;

void forEachSample(Recording& recording, const std::function<void(ImuSample&)>& change) {
  for (ImuSample& sample : recording.imu) change(sample);
}

struct Fix {
  const char *code, *sentence;
  void (*apply)(Recording&);
};

constexpr std::array kFixes{
    Fix{"accel_in_g", "the accelerometer's columns are multiplied by 9.80665 (they were in g)",
        [](Recording& r) { forEachSample(r, [](ImuSample& s) { s.accel *= kGravity; }); }},
    Fix{"accel_in_mg", "the accelerometer's columns are multiplied by 0.00980665 (they were in mg)",
        [](Recording& r) { forEachSample(r, [](ImuSample& s) { s.accel *= 1e-3 * kGravity; }); }},
    Fix{"accel_in_mm", "the accelerometer's columns are divided by 1000 (they were in mm/s²)",
        [](Recording& r) { forEachSample(r, [](ImuSample& s) { s.accel *= 1e-3; }); }},
    Fix{"gyro_in_degrees",
        "the gyroscope's columns are multiplied by 0.0174533 (they were in degrees per second)",
        [](Recording& r) { forEachSample(r, [](ImuSample& s) { s.gyro *= kRadians; }); }},
    Fix{"imu_columns_exchanged", "the gyroscope's columns are before the accelerometer's now",
        [](Recording& r) { forEachSample(r, [](ImuSample& s) { std::swap(s.gyro, s.accel); }); }},
    Fix{"clock_wrapped", "the stamps continue where a counter wrapped",
        [](Recording& r) {
          std::erase_if(r.clock_changes, [](const auto& change) {
            return change.kind == replay::ClockChange::Kind::kCounter;
          });
        }},
    Fix{"clock_set", "the stamps go on where the clock was set",
        [](Recording& r) {
          std::erase_if(r.clock_changes, [](const auto& change) { return change.common; });
        }},
    Fix{"clock_shift", "the stamps of the images are on the clock of the IMU",
        [](Recording& r) { shiftImages(shiftOfClocks(r).value_or(0.0), r); }},
    Fix{"T_BS_inverted", "T_BS of cam0 is inverted: the camera in the frame of the IMU",
        [](Recording& r) {
          auto& T_BC = r.calibration.cameras.front().T_BC;
          T_BC = T_BC.inverse();
        }},
};

const Fix* fixOf(const replay::DataFindings& findings, const std::set<std::string>& done) {
  for (const auto& finding : findings) {
    for (const Fix& fix : kFixes) {
      if (fix.code == finding.code && !done.contains(finding.code)) return &fix;
    }
  }
  return nullptr;
}

void write(const fs::path& file, std::string_view bytes) {
  std::error_code error;
  fs::create_directories(file.parent_path(), error);
  writeChecked(file, bytes);
}

void copyWhole(const fs::path& from, const fs::path& to) {
  std::error_code error;
  fs::create_directories(to.parent_path(), error);
  fs::copy_file(from, to, error);
  if (error) throwUnwritten(to, error.message());
}

/// Writes an image stored in the recording file; returns false if it cannot be read.
bool writeLoaded(const Recording::FrameFile& file, const fs::path& stem, std::string& extension) {
  const auto frame = file.load();
  if (!frame) return false;
  const std::span<const std::uint8_t> bytes = *frame.value().data;
  if (isCompressed(frame.value().encoding)) {
    extension = ".jpg";
    write(stem.string() + extension, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
    return true;
  }
  extension = ".png";
  const int type = channelsOf(frame.value().encoding) == 3 ? CV_8UC3 : CV_8UC1;
  const cv::Mat image(static_cast<int>(frame.value().height), static_cast<int>(frame.value().width),
                      type, const_cast<std::uint8_t*>(bytes.data()));
  std::vector<std::uint8_t> png;
  if (!cv::imencode(extension, image, png)) return false;
  write(stem.string() + extension, {reinterpret_cast<const char*>(png.data()), png.size()});
  return true;
}

/// Writes the image and names it by its stamp; returns nothing if it cannot be read.
std::optional<std::string> writeImage(const Recording::FrameFile& file, const fs::path& folder) {
  const std::string stem = std::to_string(toNanoseconds(file.time));
  std::string extension;
  if (file.load) {
    if (!writeLoaded(file, folder / stem, extension)) return std::nullopt;
  } else {
    std::error_code error;
    if (file.path.empty() || !fs::is_regular_file(file.path, error)) return std::nullopt;
    extension = fs::path(file.path).extension().string();
    copyWhole(file.path, folder / (stem + extension));
  }
  return stem + extension;
}

std::size_t writeImages(const Recording& recording, const fs::path& mav0,
                        const CopyProgress& progress) {
  std::map<std::size_t, std::string> lists;
  std::size_t left_out = 0, done = 0;
  for (const auto& file : recording.frames) {
    const std::string& camera = recording.calibration.cameras.at(file.camera).name;
    const auto name = writeImage(file, mav0 / camera / "data");
    if (progress) progress(++done, recording.frames.size());
    if (!name) {
      ++left_out;
      continue;
    }
    lists[file.camera] += fmt::format("{},{}\n", toNanoseconds(file.time), *name);
  }
  for (const auto& [index, lines] : lists) {
    const CameraCalibration& camera = recording.calibration.cameras[index];
    write(mav0 / camera.name / "data.csv", "#timestamp [ns],filename\n" + lines);
    write(mav0 / camera.name / "sensor.yaml", replay::cameraYaml(camera, camera.name));
  }
  return left_out;
}

void writeSamples(const Recording& recording, const fs::path& mav0) {
  std::string imu =
      "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],"
      "a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]\n";
  for (const ImuSample& s : recording.imu) {
    imu += fmt::format("{},{},{},{},{},{},{}\n", toNanoseconds(s.time), s.gyro.x(), s.gyro.y(),
                       s.gyro.z(), s.accel.x(), s.accel.y(), s.accel.z());
  }
  if (!recording.imu.empty()) {
    write(mav0 / "imu0" / "data.csv", imu);
    const ImuCalibration calibration = recording.calibration.imu.value_or(ImuCalibration{});
    write(mav0 / "imu0" / "sensor.yaml", replay::imuYaml(calibration, "imu0"));
  }
  std::string speed = "#timestamp [ns],speed [m s^-1]\n";
  for (const SpeedSample& s : recording.speed) {
    speed += fmt::format("{},{}\n", toNanoseconds(s.time), s.speed);
  }
  if (!recording.speed.empty()) write(mav0 / "speed0" / "data.csv", speed);
}

/// Refuses a target folder inside the source. Resolves links, because a fixed drive links its
/// images.
void refuseSource(const Recording& recording, const fs::path& copy) {
  std::set<fs::path> folders;
  for (const auto& frame : recording.frames) {
    if (!frame.path.empty()) folders.insert(fs::path(frame.path).parent_path());
  }
  for (const fs::path& images : folders) {
    std::error_code error;
    const fs::path folder = fs::weakly_canonical(images, error);
    const fs::path sensors = folder.parent_path().parent_path();
    replay::refuseInside(copy, sensors.filename() == "mav0" ? sensors : folder, "--fix");
  }
}

}  // namespace

RepairedDrive repairDrive(replay::Recording recording) {
  RepairedDrive drive{std::move(recording), {}, {}};
  std::set<std::string> done;
  drive.left = checkDrive(drive.recording, {});
  while (const Fix* fix = fixOf(drive.left, done)) {
    fix->apply(drive.recording);
    done.insert(fix->code);
    drive.fixes.emplace_back(fix->sentence);
    drive.left = checkDrive(drive.recording, {});
  }
  return drive;
}

std::size_t writeDrive(const replay::Recording& recording, const fs::path& folder,
                       const CopyProgress& progress) {
  std::error_code error;
  if (fs::exists(folder, error) && !fs::is_empty(folder, error)) {
    throw StartupError(ExitCode::kUsage, folder.string() +
                                             " is there and not an empty folder; --fix writes a "
                                             "new one, give another name");
  }
  refuseSource(recording, folder);
  if (recording.frames.empty() && recording.imu.empty()) {
    throw StartupError(ExitCode::kData, "there are no images and no samples to copy");
  }
  const std::size_t left_out = writeImages(recording, folder / "mav0", progress);
  writeSamples(recording, folder / "mav0");
  return left_out;
}

}  // namespace perdure::tools
