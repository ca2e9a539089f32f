// What the readers of dataset folders share, and the readers themselves.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "common/replay/dataset.h"

namespace perdure::replay {

/// Whether the folder looks like one of a kind; `reader` then says what is missing in it.
bool looksLikeEuroc(const std::filesystem::path& folder);
bool looksLikeKittiRaw(const std::filesystem::path& folder);
bool looksLikeKittiTracking(const std::filesystem::path& folder);
/// Frames are counted from 0 in the order of their times. A recording without images has the frames
/// that its odometry is about, without pixels.
Recording readRecordedDrive(const DatasetOptions& options);
Recording readEuroc(const DatasetOptions& options);
Recording readKittiRaw(const DatasetOptions& options);
Recording readKittiTracking(const DatasetOptions& options);

/// FOLDER/NAME.png, .jpg or .jpeg, the one that exists; else FOLDER/NAME.png.
std::filesystem::path imagePath(const std::filesystem::path& folder, const std::string& name);
/// Width and height of the first image that decodes; nothing where there is none.
std::optional<std::pair<std::uint32_t, std::uint32_t>> firstImageSize(
    const std::filesystem::path& folder);
/// Appends the sample if its time follows the last one's, else counts imu_not_increasing.
void appendImu(Recording& recording, const ImuSample& sample);
/// Sorts frames by time, then camera.
void sortFrames(Recording& recording);

}  // namespace perdure::replay
