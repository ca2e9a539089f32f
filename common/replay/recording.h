// Common functions of the readers for dataset folders, and the readers themselves.
#pragma once

#include <concepts>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "common/replay/dataset.h"
#include "common/replay/files/stamp_order.h"

namespace perdure::replay {

/// Applies what files/stamp_order.h decides about a sensor's stamps: counts KIND_not_increasing,
/// KIND_stray, KIND_unsorted, and adds the changes of the clock to the recording. Notes name
/// `where` and `all`. `placeOf` names a stamp by its index in the file.
void noteOrder(StampOrder& order, const std::string& kind, const std::string& where,
               const std::string& all, const std::function<std::string(std::size_t)>& placeOf,
               Recording& recording);

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
/// Orders the samples and numbers them; `where` is the file or topic.
void orderImu(Recording& recording, const std::string& where);
/// Orders items, which have a member `time`, and may have `isSame`, by files/stamp_order.h; see
/// noteOrder. Returns whether they were sorted.
template <class Item>
bool orderByTime(std::vector<Item>& items, const std::string& kind, const std::string& where,
                 const std::string& all, Recording& recording, const auto& placeOf) {
  std::vector<TimePoint> stamps;
  for (const Item& item : items) stamps.push_back(item.time);
  const auto isSame = [&](std::size_t a, std::size_t b) {
    if constexpr (requires { items[a].isSame(items[b]); }) return items[a].isSame(items[b]);
    if constexpr (std::same_as<Item, ImuSample>) {
      return items[a].gyro == items[b].gyro && items[a].accel == items[b].accel;
    }
    return true;
  };
  StampOrder order = orderOf(stamps, isSame, recording.clock_changes);
  noteOrder(order, kind, where, all, placeOf, recording);
  std::vector<Item> ordered;
  for (const std::size_t i : order.kept) {
    items[i].time = order.times[i];
    ordered.push_back(std::move(items[i]));
  }
  items = std::move(ordered);
  return order.moved == 0;
}
/// The place is the number of the message.
template <class Item>
void orderByTime(std::vector<Item>& items, const std::string& kind, const std::string& where,
                 Recording& recording) {
  orderByTime(items, kind, where, std::to_string(items.size()), recording,
              [&](std::size_t i) { return where + ", message " + std::to_string(i + 1); });
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
