// Compresses frames as JPEG and decodes them with TurboJPEG, for networks without the bandwidth for
// raw images.
#pragma once

#include "common/base/result.h"
#include "common/types/sensors.h"

namespace perdure::vision {

/// Compresses a frame with a quality of 1 … 100; a compressed frame is unchanged. Reasons:
/// image_missing, image_malformed (size and bytes disagree), jpeg_failed.
Result<Frame> compressed(const Frame& frame, int quality);

/// Returns the decoded image with packed rows, in the encoding `wanted`; an uncompressed frame is
/// unchanged. Reasons: image_missing; jpeg_malformed (truncated, corrupt, not JPEG);
/// jpeg_size_wrong (not the frame's own width and height).
Result<Frame> decompressed(const Frame& frame, ImageEncoding wanted);
/// Decodes in the colours of the compressed image.
Result<Frame> decompressed(const Frame& frame);

}  // namespace perdure::vision
