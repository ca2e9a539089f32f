// Writes overlay.mp4: the frames of the first camera with the estimates at each frame.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/replay/dataset.h"
#include "common/types/sensors.h"
#include "tools/outputs/pictures/overlay_picture.h"
#include "tools/outputs/pictures/video_file.h"

namespace perdure::tools {

class OverlayWriter {
 public:
  OverlayWriter(std::filesystem::path file, const CameraCalibration& camera, double rate_hz,
                const OverlaySettings& settings);

  /// Adds a frame; frames must be sorted by time. The first call opens the file. Fails with
  /// image_missing, image_malformed (see viewOf), image_size if the size differs from the
  /// calibration, or a reason of VideoFile if the film cannot be written.
  Result<void> add(const Frame& frame, const FrameGlance& glance);
  /// Finishes the film. Fails with video_not_written.
  Result<void> finish() { return video_ ? video_->finish() : Result<void>(); }
  std::size_t frames() const { return video_ ? video_->frames() : 0; }
  /// "H.264" or "MPEG-4"; empty before the first frame.
  std::string codec() const { return video_ ? video_->codec() : ""; }

 private:
  std::filesystem::path file_;
  OverlayPicture picture_;
  double rate_hz_;
  cv::Size image_size_;
  std::optional<VideoFile> video_;
  std::optional<Reason> refused_;
  std::vector<Eigen::Vector3d> path_;
  TimePoint start_;
};

/// Draws each frame of the log whose image is still in the folder. Returns a sentence with the
/// result, or with the reason if images or codecs are missing. Throws StartupError(kInputOutput) if
/// the film is incomplete. Calls `progress` with the number of completed frames and the total.
std::string writeOverlay(const DriveLog& log, const replay::DatasetOptions& data,
                         const std::filesystem::path& file,
                         const std::function<void(std::size_t, std::size_t)>& progress);

}  // namespace perdure::tools
