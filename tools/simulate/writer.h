// The files of a simulated folder: EuRoC's layout (Burri et al., IJRR 2016) with speed and truth
// beside it. Files are written under another name first, so that none is ever found half written.
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

/// The file's folders are made. Throws StartupError(kUnavailable) where the disk refuses.
void writeWhole(const std::filesystem::path& file, std::span<const char> bytes);

std::string cameraYaml(const CameraCalibration& camera);
std::string imuYaml(const ImuCalibration& imu);
std::string speedYaml(const sim::SpeedErrors& speed);
std::string groundTruthYaml();
/// "#timestamp [ns],filename" and a line for each name, which begins with its stamp.
std::string imageListCsv(const std::vector<TimePoint>& stamps, const std::string& extension);
std::string visibilityCsv(const std::vector<std::vector<sim::TruthView>>& views_by_frame);
/// Of the views that the border cuts.
std::string insideCsv(const std::vector<std::vector<sim::TruthView>>& views_by_frame);

/// Inertial samples, speed and states over [0, scene.seconds], with their sensor.yaml, and
/// objects_truth.json.
void writeSensors(const std::filesystem::path& folder, const sim::Scene& scene);

enum class ImageFormat { kPng, kJpeg };
/// ".png", ".jpg".
std::string extensionOf(ImageFormat format);
/// Packed rows, `channels` 1 or 3 (BGR).
void writeImage(const std::filesystem::path& file, int width, int height, int channels,
                const std::vector<std::uint8_t>& pixels, ImageFormat format);

}  // namespace perdure::tools
