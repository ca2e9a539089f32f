// Writes a simulated folder: EuRoC's layout with speed and truth. Each file is first written under
// a temporary name.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "common/sim/scene.h"
#include "common/sim/truth.h"

namespace perdure::tools {

/// Sensor time of the scene time 0.
inline constexpr TimePoint kSceneEpoch = fromNanoseconds(1'000'000'000'000);

/// Writes a file and creates its folders. Throws StartupError(kUnavailable) on a disk error.
void writeWhole(const std::filesystem::path& file, std::span<const char> bytes);

std::string cameraYaml(const CameraCalibration& camera);
std::string imuYaml(const ImuCalibration& imu);
std::string speedYaml(const sim::SpeedErrors& speed);
std::string groundTruthYaml();
/// The text "#timestamp [ns],filename", and one line per image, named by its stamp.
std::string imageListCsv(const std::vector<TimePoint>& stamps, const std::string& extension);
std::string visibilityCsv(const std::vector<std::vector<sim::TruthView>>& views_by_frame);
/// One row per view that the image border truncates.
std::string insideCsv(const std::vector<std::vector<sim::TruthView>>& views_by_frame);

/// Writes inertial samples, speed and states with their sensor.yaml, and objects_truth.json.
void writeSensors(const std::filesystem::path& folder, const sim::Scene& scene);

enum class ImageFormat { kPng, kJpeg };
std::string extensionOf(ImageFormat format);
/// Writes packed rows; `channels` is 1 or 3 (BGR).
void writeImage(const std::filesystem::path& file, int width, int height, int channels,
                const std::vector<std::uint8_t>& pixels, ImageFormat format);

}  // namespace perdure::tools
