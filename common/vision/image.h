// Converts frames to OpenCV matrices and back, without a copy if the encoding allows it.
#pragma once

#include <opencv2/core/mat.hpp>

#include "common/base/result.h"
#include "common/types/sensors.h"

namespace perdure::vision {

/// The frame's own pixels, read-only. Reasons: image_missing, image_malformed.
Result<cv::Mat> viewOf(const Frame& frame);
/// CV_8UC1: a view if the frame is mono, otherwise converted. Reasons as for viewOf.
Result<cv::Mat> monoOf(const Frame& frame);
/// CV_8UC3, BGR: a view if the frame is BGR, otherwise the grey value three times.
Result<cv::Mat> bgrOf(const Frame& frame);

/// Copies the pixels, size and encoding. Reason image_malformed: another type, or empty.
Result<void> setPixels(Frame& frame, const cv::Mat& pixels);

}  // namespace perdure::vision
