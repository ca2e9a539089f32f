// Converts camera buffers to packed grey or colour pixels.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/types/sensors.h"

namespace perdure::capture {

/// Pixel layouts, named by the order of bytes in memory.
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
  std::size_t stride = 0;  ///< bytes from row to row; unused for JPEG
};

/// Converts an image. `planes`: Y and the half-size colour planes for kNv12, kNv21 (interleaved)
/// and kYuv420 (separate); one plane for the other layouts. `wanted`: "mono8", "bgr8", or "as_is"
/// (grey stays grey, all else becomes bgr8). Fails with "image_truncated" if a plane is too short,
/// with "image_corrupt" if the JPEG is invalid, or with "image_size" if a JPEG has another size, or
/// if an odd size does not fit the layout.
Result<Frame> packed(PixelLayout layout, std::uint32_t width, std::uint32_t height,
                     const std::vector<ImagePlane>& planes, const std::string& wanted);

}  // namespace perdure::capture
