// ROS' images as frames and back.
#pragma once

#include "common/base/result.h"
#include "common/ros/messages.h"
#include "common/types/sensors.h"

namespace perdure::ros {

/// Size, encoding and pixels: grey as it is, colours as BGR, Bayer patterns and YUV 4:2:2 as BGR.
/// Of 16 bits the lower `bits` are used, and of these the upper eight. Pixels that are as a frame
/// has them are not copied. Reasons: image_encoding (the detail says which are read),
/// image_malformed.
Result<Frame> frameOf(const Image& image, int bits = 16);
/// mono8 or bgr8, in the frame <camera>_optical; not of a compressed frame.
Image imageOf(const Frame& frame);
/// Of a frame that is JPEG.
CompressedImage compressedOf(const Frame& frame);
/// Of an image with 16 bits: the fewest of 8, 10, 12, 14, 16 that hold its brightest value; 16 of
/// others.
int usedBits(const Image& image);

}  // namespace perdure::ros
