// Image files (PNG, JPEG) into pixels; what is cut short is refused, not shown half grey.
#pragma once

#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "common/base/result.h"
#include "common/types/sensors.h"

namespace perdure::vision {

/// Decodes into CV_8UC1 or CV_8UC3 (BGR): `encoding` where given, else as the file is. Of images
/// with 16 bits the lower `bits` (8 … 16) are used, and of these the upper eight. Reasons:
/// image_truncated (no end mark of JPEG or PNG), image_corrupt (does not decode).
Result<cv::Mat> decodeImage(std::string_view bytes, std::optional<ImageEncoding> encoding,
                            int bits = 16);
/// The same from a file; reason image_missing where it cannot be read.
Result<cv::Mat> decodeImageFile(const std::string& path, std::optional<ImageEncoding> encoding,
                                int bits = 16);
/// A depth image (16 bits, one channel) as it is, CV_16UC1. Reasons as above, and image_depth
/// (another kind of image).
Result<cv::Mat> decodeDepthFile(const std::string& path);
/// Of an image with 16 bits: 8, 10, 12, 14 or 16, the fewest that hold its brightest value. Of
/// other images and of what is no image: 16.
int usedBits(const std::string& path);
/// The same of the bytes of such a file.
int usedBitsIn(std::string_view bytes);

}  // namespace perdure::vision
