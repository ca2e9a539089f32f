// The parts of a phone's recording, as the readers of its formats deliver them (tables.cpp,
// records.cpp). phone.cpp makes a Recording of them.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "common/replay/recording.h"

namespace perdure::replay::phone {

/// A sample of the gyroscope (w_WB_B, rad/s) or of the accelerometer (specific force in B, m/s²).
/// B has the axes of the phone's sensors.
struct Reading {
  TimePoint time;
  Eigen::Vector3d value;
  bool isSame(const Reading& other) const { return value == other.value; }
};
using Stream = std::vector<Reading>;  ///< in order of time

/// An entry in the list of frames.
struct ListedFrame {
  TimePoint time;
  std::size_t number = 0;  ///< place in the list from 0, which is also that in the film
  std::string image = {};  ///< file of the image; empty if the frame is in the film
};

struct PhoneCamera {
  std::filesystem::path film = {};       ///< empty if the frames are image files
  std::vector<ListedFrame> frames = {};  ///< in order of time; empty: as the film has them
  std::size_t listed = 0;                ///< number of entries in the list, with unusable ones
  TimePoint film_start = {};             ///< time of the film's first frame if there is no list
  /// Lens and pose, if the recording contains them. The size may be 0; then it is that of the
  /// images.
  std::optional<CameraCalibration> calibration = {};
  std::vector<double> focal_px = {};  ///< focal lengths by the phone, which has no pose for them
};

struct Parts {
  std::string where = {};  ///< the file or folder of the inertial samples, for messages
  Stream gyro = {}, accel = {};
  std::vector<PhoneCamera> cameras = {};
};

/// A format: whether a folder has it, and its reader. Readers count and note in the recording what
/// they left out. They throw StartupError: kUnavailable if a file is missing, kData if it cannot be
/// used.
struct Format {
  bool (*looks)(const std::filesystem::path& folder);
  Parts (*read)(const std::filesystem::path& folder, Recording& recording);
};

extern const Format kMarsLogger;      ///< movie.mp4, frame_timestamps.txt, gyro_accel.csv
extern const Format kSpectacularAi;   ///< data.jsonl, data.mp4, calibration.json
extern const Format kJsonRecords;     ///< *.jsonl with sensor type, nanoseconds, values
extern const Format kFilmWithTables;  ///< OpenCamera Sensors: NAME.mp4, NAME_gyro.csv …
extern const Format kSensorLogger;    ///< Gyroscope.csv, TotalAcceleration.csv, Camera/
extern const Format kIosLogger;       ///< Frames.m4v, Frames.txt, Gyro.txt, Accel.txt
extern const Format kGoPro;           ///< a film with telemetry; the path may be the film itself

bool isFilmName(const std::filesystem::path& file);

/// Returns FOLDER/STEM.mp4, .mov, .m4v, .mkv or .avi, whichever exists; "" if none does.
std::filesystem::path filmNamed(const std::filesystem::path& folder, const std::string& stem);
/// Returns the only film of a folder; "" if it has none or several.
std::filesystem::path onlyFilm(const std::filesystem::path& folder);

/// The value of a stream at a time, interpolated between two readings that are at most `widest`
/// apart. Returns nothing outside of the stream and inside longer gaps.
std::optional<Eigen::Vector3d> valueAt(const Stream& stream, TimePoint time, Duration widest);
/// Largest interval for valueAt(): 3.5 median intervals, as for the imu_gap of Dataset.
Duration widestOf(const Stream& stream);

/// Adds a camera's frames to the recording and returns its calibration, with the size of the images
/// and without focal length if the lens is not known.
CameraCalibration addFrames(const PhoneCamera& camera, std::size_t index,
                            const DatasetOptions& options, Recording& recording);

}  // namespace perdure::replay::phone
