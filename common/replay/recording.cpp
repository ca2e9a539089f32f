#include "common/replay/recording.h"

#include <fmt/format.h>

#include <algorithm>
#include <tuple>

#include "common/base/algorithms/folder.h"
#include "common/replay/files/stamps.h"
#include "common/vision/decode.h"

namespace perdure::replay {

std::filesystem::path imagePath(const std::filesystem::path& folder, const std::string& name) {
  for (const char* extension : {".png", ".jpg", ".jpeg"}) {
    const auto path = folder / (name + extension);
    if (std::filesystem::exists(path)) return path;
  }
  return folder / (name + ".png");
}

std::optional<std::pair<std::uint32_t, std::uint32_t>> firstImageSize(
    const std::filesystem::path& folder) {
  for (const auto& file : pathsIn(folder, [](const auto&) { return true; })) {
    const auto image = vision::decodeImageFile(file.string(), std::nullopt);
    if (image) {
      return std::pair(static_cast<std::uint32_t>(image->cols),
                       static_cast<std::uint32_t>(image->rows));
    }
  }
  return std::nullopt;
}

void noteOrder(StampOrder& order, const std::string& kind, const std::string& where,
               const std::string& all, const std::function<std::string(std::size_t)>& placeOf,
               Recording& recording) {
  for (ClockChange& change : order.changes) {
    change.sensor = kind, change.place = placeOf(change.index);
    recording.clock_changes.push_back(std::move(change));
  }
  const auto note = [&](std::size_t count, const char* reason, const char* what) {
    if (count == 0) return;
    recording.reasons.add(kind + reason, count);
    if (what == nullptr) return;
    recording.notes.push_back(fmt::format("{}: {} of {}{}", where, count, all, what));
  };
  note(order.repeated, "_not_increasing", nullptr);
  note(order.strays, "_stray", " have a stamp far from their neighbours' and were left out");
  note(order.moved, "_unsorted", " were not in the order of their stamps and were sorted");
}

void orderImu(Recording& recording, const std::string& where) {
  orderByTime(recording.imu, "imu", where, recording);
  for (std::size_t i = 0; i < recording.imu.size(); ++i) recording.imu[i].sequence = i;
}

void sortFrames(Recording& recording) {
  std::stable_sort(recording.frames.begin(), recording.frames.end(),
                   [](const Recording::FrameFile& a, const Recording::FrameFile& b) {
                     return std::tie(a.time, a.camera) < std::tie(b.time, b.camera);
                   });
}

bool pairWith(const std::vector<Recording::FrameFile>& first, Recording::FrameFile& frame,
              Recording& recording) {
  const auto at = std::lower_bound(
      first.begin(), first.end(), frame.time,
      [](const auto& one, TimePoint time) { return between(time, one.time) > kPairedWithin; });
  if (at == first.end() || between(at->time, frame.time) > kPairedWithin) {
    recording.reasons.add("stereo_unmatched");
    recording.unpaired.push_back(frame.time);
    return false;
  }
  frame.index = at->index, frame.time = at->time;
  return true;
}

double rateOf(const std::vector<Recording::FrameFile>& frames, std::size_t camera) {
  std::vector<TimePoint> times;
  for (const auto& frame : frames) {
    if (frame.camera == camera) times.push_back(frame.time);
  }
  if (times.size() < 2) return 1.0;
  const double seconds = toSeconds(times.back() - times.front());
  return seconds > 0.0 ? static_cast<double>(times.size() - 1) / seconds : 1.0;
}

}  // namespace perdure::replay
