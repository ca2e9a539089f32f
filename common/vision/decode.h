// Image files (PNG, JPEG) into pixels; what is cut short is refused, not shown half grey.
#pragma once

#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "common/base/result.h"
#include "common/types/sensors.h"

namespace perdure::vision {

/// Decodes into CV_8UC1 or CV_8UC3 (BGR): `encoding` where given, else as the file is.
/// Reasons: image_truncated (no end mark of JPEG or PNG), image_corrupt (does not decode).
Result<cv::Mat> decodeImage(std::string_view bytes, std::optional<ImageEncoding> encoding);
/// The same from a file; reason image_missing where it cannot be read.
Result<cv::Mat> decodeImageFile(const std::string& path, std::optional<ImageEncoding> encoding);

}  // namespace perdure::vision
