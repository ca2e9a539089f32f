// Compresses frames as JPEG and decodes them with TurboJPEG.
#pragma once

#include "common/base/result.h"
#include "common/types/sensors.h"

namespace perdure::vision {

/// The compressed image; a frame that is already compressed is unchanged. Quality 1 … 100. Reasons:
/// image_missing, image_malformed (size and bytes disagree), jpeg_failed.
Result<Frame> compressed(const Frame& frame, int quality);

/// Decodes with packed rows as `wanted`; raw frames are unchanged. Reasons: image_missing,
/// jpeg_malformed, jpeg_size_wrong (not the frame's own size).
Result<Frame> decompressed(const Frame& frame, ImageEncoding wanted);
/// Decodes in the colours of the compressed image.
Result<Frame> decompressed(const Frame& frame);

}  // namespace perdure::vision
