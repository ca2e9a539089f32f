// Converts ROS images to frames and back.
#pragma once

#include "common/base/result.h"
#include "common/ros/messages.h"
#include "common/types/sensors.h"

namespace perdure::ros {

/// Converts an image to a frame with size, encoding and pixels. Grey images stay grey; colours,
/// Bayer patterns and YUV 4:2:2 become BGR. For 16-bit images, the upper eight of the lower `bits`
/// are used. Pixels already in a frame's format are not copied. Reasons: image_encoding (the detail
/// lists the supported ones), image_malformed.
Result<Frame> frameOf(const Image& image, int bits = 16);
/// Converts a frame, which must not be compressed, to an image of mono8 or bgr8 in
/// <camera>_optical.
Image imageOf(const Frame& frame);
CompressedImage compressedOf(const Frame& frame);
/// Number of used bits of a 16-bit image: the smallest of 8, 10, 12, 14, 16 that holds its
/// brightest value. Returns 16 for other images.
int usedBits(const Image& image);

}  // namespace perdure::ros
