// The one decoder of images (PNG, JPEG). An EXIF orientation is ignored, because lens and T_BS are
// those of the sensor. Truncated images are refused.
#pragma once

#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "common/base/result.h"
#include "common/types/sensors.h"

namespace perdure::vision {

/// CV_8UC1 or CV_8UC3 (BGR): as `encoding`, else as in the file. Of 16 bits, the upper eight of the
/// lower `bits` are used. Reasons: image_truncated, image_corrupt.
Result<cv::Mat> decodeImage(std::string_view bytes, std::optional<ImageEncoding> encoding,
                            int bits = 16, int reduce = 1);
/// Reason image_missing if it cannot be read. `reduce` (1, 2, 4, 8) makes it smaller, faster.
Result<cv::Mat> decodeImageFile(const std::string& path, std::optional<ImageEncoding> encoding,
                                int bits = 16, int reduce = 1);
/// A depth image (16 bits, one channel), CV_16UC1. Also reason image_depth.
Result<cv::Mat> decodeDepthFile(const std::string& path);
/// Number of used bits of a 16-bit image: the smallest of 8, 10, 12, 14, 16 that holds its
/// brightest value. Returns 16 for other images and for invalid files.
int usedBits(const std::string& path);
int usedBitsIn(std::string_view bytes);

}  // namespace perdure::vision
