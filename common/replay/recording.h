// Common functions of the readers for dataset folders, and the readers themselves.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "common/replay/dataset.h"
#include "common/replay/files/stamps.h"

namespace perdure::replay {

/// Counts and notes the stamps that an order leaves out or moves, of `all` in `where`.
void noteOrder(const StampOrder& order, const std::string& kind, const std::string& where,
               const std::string& all, Recording& recording);

/// Returns whether the folder has the layout of a kind. The reader then reports missing parts.
bool looksLikeEuroc(const std::filesystem::path& folder);
bool looksLikeKittiRaw(const std::filesystem::path& folder);
bool looksLikeKittiTracking(const std::filesystem::path& folder);
/// Colour images with one pose file each, or a scene of such sequences (seq-01 …).
bool looksLikeSevenScenes(const std::filesystem::path& folder);
/// Frames are numbered from 0 in the order of their times. A recording without images has the
/// frames of its odometry, without pixels.
Recording readRecordedDrive(const DatasetOptions& options);
/// The rig file gives the calibration that is missing in the recording.
Recording readRosDrive(const DatasetOptions& options);
Recording readEuroc(const DatasetOptions& options);
Recording readKittiRaw(const DatasetOptions& options);
Recording readKittiTracking(const DatasetOptions& options);
Recording readSevenScenes(const DatasetOptions& options);

/// FOLDER/NAME.png, .jpg or .jpeg, whichever exists; else FOLDER/NAME.png.
std::filesystem::path imagePath(const std::filesystem::path& folder, const std::string& name);
/// Width and height of the first image that can be decoded. Returns nothing if there is none.
std::optional<std::pair<std::uint32_t, std::uint32_t>> firstImageSize(
    const std::filesystem::path& folder);
/// Sorts the samples by time and numbers them. Samples left out are counted as imu_not_increasing
/// or imu_stray, moved ones as imu_unsorted (files/stamps.h).
void orderImu(Recording& recording);
/// Sorts items by their stamps, and counts KIND_not_increasing, KIND_stray, KIND_unsorted. Notes
/// name `where` and `all`. Returns whether the items were sorted.
template <class Item>
bool orderByTime(std::vector<Item>& items, const std::string& kind, const std::string& where,
                 const std::string& all, Recording& recording, const auto& timeOf) {
  std::vector<TimePoint> stamps;
  for (const Item& item : items) stamps.push_back(timeOf(item));
  const StampOrder order = orderOf(stamps);
  noteOrder(order, kind, where, all, recording);
  std::vector<Item> ordered;
  for (const std::size_t i : order.kept) ordered.push_back(std::move(items[i]));
  items = std::move(ordered);
  return order.moved == 0;
}
template <class Item>
void orderByTime(std::vector<Item>& items, const std::string& kind, Recording& recording,
                 const auto& timeOf) {
  orderByTime(items, kind, kind, std::to_string(items.size()), recording, timeOf);
}
/// Sorts frames by time, then camera.
void sortFrames(Recording& recording);
inline constexpr Duration kPairedWithin = std::chrono::milliseconds(5);
/// Gives a frame of cam1 the index and the time of the frame of cam0 taken within kPairedWithin.
/// Counts the frame and returns false if there is none. `first` is sorted by time.
bool pairWith(const std::vector<Recording::FrameFile>& first, Recording::FrameFile& frame,
              Recording& recording);
/// Frame rate of a camera in Hz; 1 if it cannot be determined.
double rateOf(const std::vector<Recording::FrameFile>& frames, std::size_t camera);

}  // namespace perdure::replay
