// Access to the memory of a libcamera frame buffer, as planes of an image.
#pragma once

#include <libcamera/libcamera.h>

#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include "services/capture/live/pixels.h"

namespace perdure::capture {

/// Maps the buffer for reading during the lifetime of this object.
class MappedBuffer {
 public:
  explicit MappedBuffer(const libcamera::FrameBuffer& buffer);
  ~MappedBuffer();
  MappedBuffer(const MappedBuffer&) = delete;
  MappedBuffer& operator=(const MappedBuffer&) = delete;

  const std::vector<std::span<const std::uint8_t>>& planes() const { return planes_; }
  /// Begins or ends reading, so that the device's writes are visible. For memory other than DMA
  /// buffers the call fails, which has no effect.
  void sync(bool begin) const;

 private:
  struct Mapping {
    void* at = nullptr;
    std::size_t length = 0;
  };
  std::map<int, Mapping> mappings_;  ///< mappings by file descriptor
  std::vector<std::span<const std::uint8_t>> planes_;
};

/// Returns the planes that packed() needs, even if the driver returns all planes as one.
std::vector<ImagePlane> imagePlanes(const libcamera::StreamConfiguration& stream,
                                    PixelLayout layout, const MappedBuffer& memory,
                                    const libcamera::FrameMetadata& metadata);

}  // namespace perdure::capture
