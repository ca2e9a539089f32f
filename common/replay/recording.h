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

/// Reports the decisions of files/stamp_order.h about a sensor's stamps: counts
/// KIND_not_increasing, KIND_stray and KIND_unsorted, adds the changes of the clock to the
/// recording, and writes notes. In notes, `where` is the place and `all` the number of items.
/// `placeOf` names a stamp by its index in the file.
void noteOrder(StampOrder& order, const std::string& kind, const std::string& where,
               const std::string& all, const std::function<std::string(std::size_t)>& placeOf,
               Recording& recording);

/// The looksLike functions return whether the folder has the layout of a kind. The reader of that
/// kind reports missing parts.
bool looksLikeEuroc(const std::filesystem::path& folder);
bool looksLikeKittiRaw(const std::filesystem::path& folder);
bool looksLikeKittiTracking(const std::filesystem::path& folder);
/// The folder has colour images with one pose file each, or is a scene of such sequences (seq-01
/// …).
bool looksLikeSevenScenes(const std::filesystem::path& folder);
/// The folder was written by a logger of a phone (phone/parts.h).
bool looksLikePhone(const std::filesystem::path& folder);
/// The path is a film, or a folder with a film that has a GoPro's telemetry. readPhone() reads it.
bool looksLikeGoPro(const std::filesystem::path& path);
/// Reads a recording of `perdure record`. Frames are numbered from 0 in the order of their times. A
/// recording without images has the frames of its odometry, without pixels.
Recording readRecordedDrive(const DatasetOptions& options);
/// Reads a recording of ROS. The rig file overrides the calibration in the recording.
Recording readRosDrive(const DatasetOptions& options);
Recording readEuroc(const DatasetOptions& options);
Recording readKittiRaw(const DatasetOptions& options);
Recording readKittiTracking(const DatasetOptions& options);
Recording readSevenScenes(const DatasetOptions& options);
Recording readPhone(const DatasetOptions& options);

/// Returns FOLDER/NAME.png, .jpg or .jpeg, whichever exists; otherwise FOLDER/NAME.png.
std::filesystem::path imagePath(const std::filesystem::path& folder, const std::string& name);
/// Width and height of the first image that can be decoded. Returns nothing if there is none.
std::optional<std::pair<std::uint32_t, std::uint32_t>> firstImageSize(
    const std::filesystem::path& folder);
/// Orders the inertial samples by time and numbers them; `where` is the file or topic.
void orderImu(Recording& recording, const std::string& where);
/// Orders items by their member `time` (files/stamp_order.h), and reports it by noteOrder(). An
/// item may have a member isSame() that recognises repeated samples. Returns true if the items were
/// in order.
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
/// Names a place in messages by `where` and the number of the message.
template <class Item>
void orderByTime(std::vector<Item>& items, const std::string& kind, const std::string& where,
                 Recording& recording) {
  orderByTime(items, kind, where, std::to_string(items.size()), recording,
              [&](std::size_t i) { return where + ", message " + std::to_string(i + 1); });
}
/// Sorts frames by time, then camera.
void sortFrames(Recording& recording);
inline constexpr Duration kPairedWithin = std::chrono::milliseconds(5);
/// Gives a frame of cam1 the index and the time of the frame of cam0 taken within kPairedWithin. If
/// there is none, counts the frame and returns false. `first` is sorted by time.
bool pairWith(const std::vector<Recording::FrameFile>& first, Recording::FrameFile& frame,
              Recording& recording);
/// Frame rate of a camera in Hz; 1 if it cannot be determined.
double rateOf(const std::vector<Recording::FrameFile>& frames, std::size_t camera);

}  // namespace perdure::replay
