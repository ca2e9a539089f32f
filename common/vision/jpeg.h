// Frames as JPEG and back, by TurboJPEG: for networks that raw images are too wide for.
#pragma once

#include "common/base/result.h"
#include "common/types/sensors.h"

namespace perdure::vision {

/// The same image, compressed; one that is compressed already stays as it is. Quality 1 … 100.
/// Reasons: image_missing, image_malformed (size and bytes disagree), jpeg_failed.
Result<Frame> compressed(const Frame& frame, int quality);

/// The same image, packed rows, as `wanted` where it is compressed; one that is not stays as it is.
/// Reasons: image_missing; jpeg_malformed (cut short, corrupt, no JPEG); jpeg_size_wrong (not the
/// frame's own width and height).
Result<Frame> decompressed(const Frame& frame, ImageEncoding wanted);
/// In the colours that it was compressed in.
Result<Frame> decompressed(const Frame& frame);

}  // namespace perdure::vision
