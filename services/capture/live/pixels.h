// The buffers of cameras as packed grey or colour pixels.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/types/sensors.h"

namespace perdure::capture {

/// By the order of bytes in memory.
enum class PixelLayout {
  kGrey,
  kBgr,
  kRgb,
  kBgrx,
  kRgbx,
  kYuyv,
  kUyvy,
  kNv12,
  kNv21,
  kYuv420,
  kJpeg
};

struct ImagePlane {
  std::span<const std::uint8_t> bytes;
  std::size_t stride = 0;  ///< bytes from row to row; not used of JPEG
};

/// `planes`: Y and the two half planes of kNv12, kNv21 (together) and kYuv420 (apart); one of the
/// others. `wanted`: "as_is" (grey stays grey, the rest is bgr8), "mono8", "bgr8".
/// Reasons: "image_truncated" where a plane is too short, "image_corrupt" of JPEG, "image_size".
Result<Frame> packed(PixelLayout layout, std::uint32_t width, std::uint32_t height,
                     const std::vector<ImagePlane>& planes, const std::string& wanted);

}  // namespace perdure::capture
