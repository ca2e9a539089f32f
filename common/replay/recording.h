// What the readers of dataset folders share, and the readers themselves.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "common/replay/dataset.h"
#include "common/replay/files/stamps.h"

namespace perdure::replay {

/// Counts what an order leaves out or moves, and says it.
void noteOrder(const StampOrder& order, const std::string& kind, std::size_t all,
               Recording& recording);

/// Whether the folder looks like one of a kind; `reader` then says what is missing in it.
bool looksLikeEuroc(const std::filesystem::path& folder);
bool looksLikeKittiRaw(const std::filesystem::path& folder);
bool looksLikeKittiTracking(const std::filesystem::path& folder);
/// Colour images with a pose file each, or a scene of such sequences (seq-01 …).
bool looksLikeSevenScenes(const std::filesystem::path& folder);
/// Frames are counted from 0 in the order of their times. A recording without images has the frames
/// that its odometry is about, without pixels.
Recording readRecordedDrive(const DatasetOptions& options);
/// What is missing in the recording the rig file says.
Recording readRosDrive(const DatasetOptions& options);
Recording readEuroc(const DatasetOptions& options);
Recording readKittiRaw(const DatasetOptions& options);
Recording readKittiTracking(const DatasetOptions& options);
Recording readSevenScenes(const DatasetOptions& options);

/// FOLDER/NAME.png, .jpg or .jpeg, the one that exists; else FOLDER/NAME.png.
std::filesystem::path imagePath(const std::filesystem::path& folder, const std::string& name);
/// Width and height of the first image that decodes; nothing where there is none.
std::optional<std::pair<std::uint32_t, std::uint32_t>> firstImageSize(
    const std::filesystem::path& folder);
/// Brings the samples into the order of their times and numbers them. What is left out is counted:
/// imu_not_increasing, imu_stray; what was moved: imu_unsorted (files/stamps.h).
void orderImu(Recording& recording);
/// Brings items with stamps into order, and counts KIND_not_increasing, KIND_stray, KIND_unsorted.
template <class Item, class TimeOf>
void orderByTime(std::vector<Item>& items, const std::string& kind, Recording& recording,
                 TimeOf&& timeOf) {
  std::vector<TimePoint> stamps;
  for (const Item& item : items) stamps.push_back(timeOf(item));
  const StampOrder order = orderOf(stamps);
  noteOrder(order, kind, items.size(), recording);
  std::vector<Item> ordered;
  for (const std::size_t i : order.kept) ordered.push_back(std::move(items[i]));
  items = std::move(ordered);
}
/// Sorts frames by time, then camera.
void sortFrames(Recording& recording);
inline constexpr Duration kPairedWithin = std::chrono::milliseconds(5);
/// The frame of cam0 that was taken within kPairedWithin; `first` by time.
const Recording::FrameFile* pairOf(const std::vector<Recording::FrameFile>& first, TimePoint time);
/// Frames a second of a camera; 1 where they do not tell.
double rateOf(const std::vector<Recording::FrameFile>& frames, std::size_t camera);

}  // namespace perdure::replay
