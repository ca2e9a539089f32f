// KITTI tracking: calib/SEQUENCE.txt and, if present, image_02, image_03, label_02. The sequences
// have no stamps: 10 Hz from t = 0 is assumed.
#include <fmt/format.h>

#include <algorithm>

#include "common/base/algorithms/folder.h"
#include "common/base/errors.h"
#include "common/replay/files/kitti_calibration.h"
#include "common/replay/files/kitti_labels.h"
#include "common/replay/files/text_file.h"
#include "common/replay/recording.h"

namespace perdure::replay {
namespace {

namespace fs = std::filesystem;

constexpr Duration kInterval = std::chrono::milliseconds(100);
constexpr std::int64_t kMostImages = 1'000'000;  // image names have six digits

std::string availableSequences(const fs::path& root) {
  const auto isText = [](const fs::path& file) { return file.extension() == ".txt"; };
  std::vector<std::string> names;
  for (const fs::path& file : pathsIn(root / "calib", isText))
    names.push_back(file.stem().string());
  return names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", "));
}

fs::path calibrationFile(const DatasetOptions& options) {
  const auto& sequence = options.sequence;
  if (sequence.empty()) {
    throw StartupError(ExitCode::kUsage,
                       "{} holds several sequences: name one with --sequence ({})",
                       options.path.c_str(), availableSequences(options.path));
  }
  const fs::path file = options.path / "calib" / (sequence + ".txt");
  if (!fs::exists(file)) {
    throwMissing(file, "the calibration of sequence " + sequence,
                 "there are " + availableSequences(options.path));
  }
  return file;
}

std::size_t countImages(const fs::path& folder) {
  std::size_t count = 0;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const auto number = parseInteger(entry.path().stem().string());
    if (number && *number >= 0 && *number < kMostImages)
      count = std::max(count, static_cast<std::size_t>(*number) + 1);
  }
  return count;
}

std::size_t countFrames(const DatasetOptions& options, const fs::path& images) {
  if (fs::is_directory(images)) return countImages(images);
  if (options.frame_count) return *options.frame_count;
  const fs::path labels = options.path / "label_02" / (options.sequence + ".txt");
  if (!fs::exists(labels)) {
    throwMissing(images, "the folder of images of sequence " + options.sequence,
                 "without images and labels a pose file of one line a frame must be given, so "
                 "that the number of frames is known");
  }
  std::size_t count = 0;
  for (const auto& label : readKittiLabels(labels)) count = std::max(count, label.frame + 1);
  return count;
}

void addFrames(const fs::path& folder, std::size_t camera, Recording& recording) {
  for (std::size_t i = 0; i < recording.frame_count; ++i) {
    const bool has_images = fs::is_directory(folder);
    recording.frames.push_back(
        {TimePoint(static_cast<std::int64_t>(i) * kInterval), i, camera,
         has_images ? imagePath(folder, fmt::format("{:06}", i)).string() : ""});
  }
}

std::pair<std::uint32_t, std::uint32_t> imageSize(const DatasetOptions& options,
                                                  const fs::path& images) {
  if (options.image_size) return *options.image_size;
  if (fs::is_directory(images)) {
    if (const auto size = firstImageSize(images)) return *size;
  }
  const ImageSize size = trackingImageSize(options.sequence);
  return {size.width, size.height};
}

/// Reads the pose file beside the labels. If there are several, the most accurate one is used.
std::optional<PoseFile> readPoses(const DatasetOptions& options) {
  for (const char* folder : {"poses", "poses_orb", "poses_oxts"}) {
    const fs::path file = options.path / folder / (options.sequence + ".txt");
    if (fs::exists(file)) return PoseFile::read(file);
  }
  return std::nullopt;
}

}  // namespace

bool looksLikeKittiTracking(const fs::path& folder) {
  return fs::is_directory(folder / "calib") || fs::is_directory(folder / "label_02");
}

Recording readKittiTracking(const DatasetOptions& options) {
  if (!fs::is_directory(options.path / "calib")) {
    throwMissing(options.path / "calib", "the folder of calibrations",
                 "unpack KITTI tracking's calib beside label_02");
  }
  KittiCalibration calibration = readTrackingCalibration(calibrationFile(options));
  const fs::path left = options.path / "image_02" / options.sequence;
  const fs::path right = options.path / "image_03" / options.sequence;
  std::tie(calibration.width, calibration.height) = imageSize(options, left);
  Recording recording;
  recording.kind = DatasetKind::kKittiTracking;
  recording.frame_count = countFrames(options, left);
  recording.calibration.cameras.push_back(calibration.camera("cam0"));
  addFrames(left, 0, recording);
  if (fs::is_directory(left) && fs::is_directory(right)) {
    recording.calibration.cameras.push_back(calibration.camera("cam1"));
    addFrames(right, 1, recording);
  }
  sortFrames(recording);
  recording.truth = readPoses(options);
  return recording;
}

}  // namespace perdure::replay
