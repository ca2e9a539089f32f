// Decodes a film (MP4, MOV, MKV, AVI …) frame by frame with FFmpeg. Frames are found by number: the
// packets are listed when the film is opened, and decoding starts at the nearest key frame. At most
// one decoded frame is kept. A declared rotation is ignored, because lens and T_BS are those of the
// sensor.
#pragma once

#include <filesystem>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <vector>

#include "common/base/result.h"
#include "common/base/time.h"
#include "common/types/sensors.h"

namespace perdure::vision {

class Film {
 public:
  /// Reasons: film_unreadable (no film, not finished, or without a picture track), film_codec.
  static Result<std::unique_ptr<Film>> open(const std::filesystem::path& file);
  ~Film();

  cv::Size size() const;
  /// Presentation time of each frame since the start of the film, in increasing order.
  const std::vector<Duration>& times() const { return times_; }
  /// Clockwise rotation by which players show the film upright, in degrees; often 90 for phones.
  int rotation_deg() const { return rotation_deg_; }

  /// Decodes frame `index` < times().size() as CV_8UC1 or CV_8UC3 (BGR): as given by `encoding`,
  /// otherwise as in the film. Fast if indices increase. Reason: image_corrupt.
  Result<cv::Mat> at(std::size_t index, std::optional<ImageEncoding> encoding);

 private:
  struct Decoder;
  explicit Film(std::unique_ptr<Decoder> decoder);

  std::unique_ptr<Decoder> decoder_;
  std::vector<Duration> times_;
  int rotation_deg_ = 0;
};

}  // namespace perdure::vision
