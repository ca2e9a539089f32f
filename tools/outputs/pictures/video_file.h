// An MP4 film by FFmpeg: H.264 (4:2:0), or MPEG-4 part 2. OpenCV's VideoWriter has only x264's
// medium preset, which takes five times as long.
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <string>

#include "common/base/result.h"

namespace perdure::tools {

class VideoFile {
 public:
  /// Needs even sides and rate > 0. Fails with video_no_codec if no encoder is available, and with
  /// video_not_written if the file cannot be created.
  static Result<VideoFile> open(const std::filesystem::path& file, const cv::Size& size,
                                double rate_hz);
  VideoFile(VideoFile&&) noexcept;
  VideoFile& operator=(VideoFile&&) noexcept;
  ~VideoFile();  ///< finishes the film

  /// Appends a picture of type CV_8UC3 (blue, green, red) in the film's size. Fails with
  /// video_not_written if the disk is full.
  Result<void> write(const cv::Mat& picture);
  Result<void> finish();
  std::size_t frames() const;
  const std::string& codec() const;  ///< "H.264" or "MPEG-4"

 private:
  struct Film;
  explicit VideoFile(std::unique_ptr<Film> film);
  std::unique_ptr<Film> film_;
};

}  // namespace perdure::tools
