// The one decoder of images (PNG, JPEG). An orientation tag (EXIF) is ignored, because lens and
// T_BS are those of the sensor. Truncated images are refused instead of being filled with grey;
// bytes after the end mark are ignored.
#pragma once

#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "common/base/result.h"
#include "common/types/sensors.h"

namespace perdure::vision {

/// Decodes into CV_8UC1 or CV_8UC3 (BGR): as given by `encoding`, otherwise as in the file. For
/// 16-bit images, the upper eight of the lower `bits` (8 … 16) are used. Reasons: image_truncated
/// (no end mark of JPEG or PNG), image_corrupt (cannot be decoded).
Result<cv::Mat> decodeImage(std::string_view bytes, std::optional<ImageEncoding> encoding,
                            int bits = 16, int reduce = 1);
/// Decodes a file; reason image_missing if it cannot be read. With `reduce` (1, 2, 4, 8) the image
/// is smaller by that factor, which decodes large JPEGs faster.
Result<cv::Mat> decodeImageFile(const std::string& path, std::optional<ImageEncoding> encoding,
                                int bits = 16, int reduce = 1);
/// Decodes a depth image (16 bits, one channel) without conversion, CV_16UC1. Fails with
/// image_missing, image_corrupt, or image_depth for another kind of image.
Result<cv::Mat> decodeDepthFile(const std::string& path);
/// Number of used bits of a 16-bit image: the smallest of 8, 10, 12, 14, 16 that holds its
/// brightest value. Returns 16 for other images and for invalid files.
int usedBits(const std::string& path);
int usedBitsIn(std::string_view bytes);

}  // namespace perdure::vision
