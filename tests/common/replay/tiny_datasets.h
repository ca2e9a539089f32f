// Dataset folders of a few frames for tests: each format with all parts that a reader needs.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <functional>
#include <string>

#include "common/base/errors.h"

namespace perdure::replay {

/// Returns an empty folder under the test's own temporary folder; earlier content is removed.
std::filesystem::path freshFolder(const std::string& name);
void writeText(const std::filesystem::path& file, const std::string& text);
std::string readText(const std::filesystem::path& file);
/// Writes a grey ramp: .png or .jpg, one or three channels.
void writeImage(const std::filesystem::path& file, int width, int height, int channels);
void writeGrey(const std::filesystem::path& file, int width, int height, int value);
/// Writes a 16-bit PNG with a ramp from 0 to the largest value of `bits` bits.
void writeDeepImage(const std::filesystem::path& file, int width, int height, int bits);
void truncate(const std::filesystem::path& file, double share);

/// EuRoC: five 32×24 frames at 20 Hz from 1 s, IMU at 200 Hz from 0.95 s to 1.25 s, truth.
std::filesystem::path tinyEuroc(const std::string& name, bool stereo = false);
/// KITTI raw: four 48×16 frames at 10 Hz, JPEG on the left, PNG on the right, OXTS 7 ms later.
std::filesystem::path tinyKittiRaw(const std::string& name);
/// KITTI tracking: sequences 0000 (three frames, images) and 0001 (labels only, up to frame 4).
std::filesystem::path tinyKittiTracking(const std::string& name);

/// 7-Scenes: three 640×480 frames of a camera 1.4 m above a floor, with a wall ahead. The camera is
/// pitched down by 25° and rolled by 10°. The frame of the poses is that of the first camera.
/// `folders`: files are named color/000000.jpg instead of frame-000000.color.png.
std::filesystem::path tinySevenScenes(const std::string& name, bool folders = false);
/// Returns the up direction of tinySevenScenes in the frame of the poses.
Eigen::Vector3d tinySevenScenesUp();

/// Returns the message of the StartupError that `action` throws, or "" if it throws none.
std::string startupErrorOf(const std::function<void()>& action);
/// Returns the exit status of the StartupError that `action` throws, or kOk if it throws none.
ExitCode startupCodeOf(const std::function<void()>& action);

}  // namespace perdure::replay
