// Recordings of a few frames as the loggers of phones write them.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "common/types/sensors.h"

namespace perdure::replay {

inline constexpr int kFilmFrames = 40;  ///< at 20 Hz from 1 s

/// Writes a film of 64×48 pixels, whose frames show their numbers.
void writeFilm(const std::filesystem::path& file, int frames = kFilmFrames,
               const std::string& codec = "mp4v");
/// Writes an image like frame `number` of a film.
void writePicture(const std::filesystem::path& file, int number);
/// The number that a frame shows.
int numberOf(const Frame& frame);
/// Declares in an MP4 that its frames are to be turned clockwise by 90°.
void turnFilm(const std::filesystem::path& file);

std::int64_t frameStamp(int frame);  ///< ns
/// Stamps of the gyroscope from 0.9 s to 3.1 s at 200 Hz, and of the accelerometer at 100 Hz, in
/// ns.
std::vector<std::int64_t> gyroStamps();
std::vector<std::int64_t> accelStamps();
/// The specific force at a stamp, which grows linearly.
Eigen::Vector3d forceAt(std::int64_t ns);
inline const Eigen::Vector3d kTurn{0.1, 0.2, 0.3};

/// MARS Logger, with both sensors at the gyroscope's stamps.
std::filesystem::path tinyMars(const std::string& name, int frames = kFilmFrames);
/// Spectacular AI with one camera and its calibration.
std::filesystem::path tinySpectacular(const std::string& name);
/// Android's sensor events: camera_frames.jsonl, imu_data.jsonl over several lines each record, and
/// images.
std::filesystem::path tinyRecords(const std::string& name);
/// OpenCamera Sensors: VID_1.mp4, and VID_1_gyro.csv … without heads.
std::filesystem::path tinyOpenCamera(const std::string& name);
/// Sensor Logger on iOS: Accelerometer and Gravity, towards gravity; a film named by its time.
std::filesystem::path tinySensorLogger(const std::string& name);
/// ios_logger: stamps in seconds, accelerations in g.
std::filesystem::path tinyIosLogger(const std::string& name);

/// A rig of 64×48 pixels without distortion, whose camera looks along the y axis of the body.
std::filesystem::path phoneRig(const std::string& name);

}  // namespace perdure::replay
