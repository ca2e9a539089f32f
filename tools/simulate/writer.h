// Writes a simulated folder: EuRoC's layout with speed and truth, each file under a temporary name
// first.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "common/sim/scene.h"
#include "common/sim/truth.h"

namespace perdure::tools {

/// Sensor time of a scene's t = 0.
inline constexpr TimePoint kSceneEpoch = fromNanoseconds(1'000'000'000'000);

/// Creates the file's folders. Throws StartupError(kUnavailable) on a disk error.
void writeWhole(const std::filesystem::path& file, std::span<const char> bytes);

std::string cameraYaml(const CameraCalibration& camera);
std::string imuYaml(const ImuCalibration& imu);
std::string speedYaml(const sim::SpeedErrors& speed);
std::string groundTruthYaml();
/// "#timestamp [ns],filename" and a line for each name, which begins with its stamp.
std::string imageListCsv(const std::vector<TimePoint>& stamps, const std::string& extension);
std::string visibilityCsv(const std::vector<std::vector<sim::TruthView>>& views_by_frame);
/// Rows of the views that the image border truncates.
std::string insideCsv(const std::vector<std::vector<sim::TruthView>>& views_by_frame);

/// Inertial samples, speed and states with their sensor.yaml, and objects_truth.json.
void writeSensors(const std::filesystem::path& folder, const sim::Scene& scene);

enum class ImageFormat { kPng, kJpeg };
std::string extensionOf(ImageFormat format);
/// Packed rows, `channels` 1 or 3 (BGR).
void writeImage(const std::filesystem::path& file, int width, int height, int channels,
                const std::vector<std::uint8_t>& pixels, ImageFormat format);

}  // namespace perdure::tools
