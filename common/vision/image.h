// Converts frames to OpenCV matrices and back, without a copy if the encoding allows it.
#pragma once

#include <opencv2/core/mat.hpp>

#include "common/base/result.h"
#include "common/types/sensors.h"

namespace perdure::vision {

/// A view of the frame's pixels (CV_8UC1 or CV_8UC3, BGR); read-only, and valid as long as
/// frame.data. Reasons: image_missing (no data), image_malformed (size and bytes disagree).
Result<cv::Mat> viewOf(const Frame& frame);
/// CV_8UC1: a view if the frame is mono, otherwise converted. Reasons as for viewOf.
Result<cv::Mat> monoOf(const Frame& frame);
/// CV_8UC3, BGR: a view if the frame is BGR, otherwise the grey value three times.
Result<cv::Mat> bgrOf(const Frame& frame);

/// Copies the pixels into the frame and sets its size and encoding. Reason: image_malformed, if
/// `pixels` are neither CV_8UC1 nor CV_8UC3, or empty.
Result<void> setPixels(Frame& frame, const cv::Mat& pixels);

}  // namespace perdure::vision
