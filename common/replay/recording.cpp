#include "common/replay/recording.h"

#include <algorithm>
#include <tuple>

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
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  for (const auto& file : files) {
    const auto image = vision::decodeImageFile(file.string(), std::nullopt);
    if (image) {
      return std::pair(static_cast<std::uint32_t>(image->cols),
                       static_cast<std::uint32_t>(image->rows));
    }
  }
  return std::nullopt;
}

void appendImu(Recording& recording, const ImuSample& sample) {
  if (!recording.imu.empty() && sample.time <= recording.imu.back().time) {
    recording.reasons.add("imu_not_increasing");
    return;
  }
  recording.imu.push_back(sample);
  recording.imu.back().sequence = recording.imu.size() - 1;
}

void sortFrames(Recording& recording) {
  std::stable_sort(recording.frames.begin(), recording.frames.end(),
                   [](const Recording::FrameFile& a, const Recording::FrameFile& b) {
                     return std::tie(a.time, a.camera) < std::tie(b.time, b.camera);
                   });
}

}  // namespace perdure::replay
