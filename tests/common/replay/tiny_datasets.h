// Dataset folders of a few frames, made for tests: each format with every part that a reader needs.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <functional>
#include <string>

#include "common/base/errors.h"

namespace perdure::replay {

/// An empty folder under the test's own temporary folder; what was there is removed.
std::filesystem::path freshFolder(const std::string& name);
void writeText(const std::filesystem::path& file, const std::string& text);
std::string readText(const std::filesystem::path& file);
/// A grey ramp; .png or .jpg, one or three channels.
void writeImage(const std::filesystem::path& file, int width, int height, int channels);
void writeGrey(const std::filesystem::path& file, int width, int height, int value);
/// A ramp from 0 to the brightest value of so many bits, in a PNG of 16.
void writeDeepImage(const std::filesystem::path& file, int width, int height, int bits);
void truncate(const std::filesystem::path& file, double share);

/// EuRoC: five 32×24 frames at 20 Hz from 1 s, IMU at 200 Hz from 0.95 s to 1.25 s, truth.
std::filesystem::path tinyEuroc(const std::string& name, bool stereo = false);
/// KITTI raw: four 48×16 frames at 10 Hz, JPEG on the left, PNG on the right, OXTS 7 ms later.
std::filesystem::path tinyKittiRaw(const std::string& name);
/// KITTI tracking: sequences 0000 (three frames, images) and 0001 (labels only, up to frame 4).
std::filesystem::path tinyKittiTracking(const std::string& name);

/// 7-Scenes: three 640×480 frames of a camera 1.4 m above a floor, with a wall ahead, that looks
/// 25° down and is rolled by 10°. The poses' frame is that of the first camera. `folders`: as
/// color/000000.jpg and so on, instead of frame-000000.color.png.
std::filesystem::path tinySevenScenes(const std::string& name, bool folders = false);
/// Of those: up in the poses' frame.
Eigen::Vector3d tinySevenScenesUp();

/// The message of the StartupError that `action` throws, or "" where it throws none.
std::string startupErrorOf(const std::function<void()>& action);
/// Its exit status; kOk where it throws none.
ExitCode startupCodeOf(const std::function<void()>& action);

}  // namespace perdure::replay
