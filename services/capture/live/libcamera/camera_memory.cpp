#include "services/capture/live/libcamera/camera_memory.h"

#include <linux/dma-buf.h>
#include <sys/ioctl.h>
#include <sys/mman.h>

#include <algorithm>

namespace perdure::capture {

MappedBuffer::MappedBuffer(const libcamera::FrameBuffer& buffer) {
  for (const auto& plane : buffer.planes()) {
    const std::size_t length = std::size_t{plane.offset} + plane.length;
    Mapping& mapping = mappings_[plane.fd.get()];
    mapping.length = std::max(mapping.length, length);
  }
  for (auto& [fd, mapping] : mappings_) {
    mapping.at = mmap(nullptr, mapping.length, PROT_READ, MAP_SHARED, fd, 0);
  }
  for (const auto& plane : buffer.planes()) {
    const void* at = mappings_[plane.fd.get()].at;
    if (at == MAP_FAILED) continue;
    planes_.emplace_back(static_cast<const std::uint8_t*>(at) + plane.offset, plane.length);
  }
}

MappedBuffer::~MappedBuffer() {
  for (const auto& [fd, mapping] : mappings_) {
    if (mapping.at != MAP_FAILED) munmap(mapping.at, mapping.length);
  }
}

void MappedBuffer::sync(bool begin) const {
  const std::uint64_t flags = DMA_BUF_SYNC_READ | (begin ? DMA_BUF_SYNC_START : DMA_BUF_SYNC_END);
  dma_buf_sync sync{flags};
  for (const auto& [fd, mapping] : mappings_) (void)ioctl(fd, DMA_BUF_IOCTL_SYNC, &sync);
}

std::vector<ImagePlane> imagePlanes(const libcamera::StreamConfiguration& stream,
                                    PixelLayout layout, const MappedBuffer& memory,
                                    const libcamera::FrameMetadata& metadata) {
  std::vector<ImagePlane> planes;
  for (const auto& plane : memory.planes()) planes.push_back({plane, stream.stride});
  if (layout == PixelLayout::kJpeg && !planes.empty() && !metadata.planes().empty()) {
    const std::size_t used =
        std::min<std::size_t>(metadata.planes()[0].bytesused, planes[0].bytes.size());
    planes[0].bytes = planes[0].bytes.first(used);
  }
  const bool apart = layout == PixelLayout::kYuv420;
  const bool halved = apart || layout == PixelLayout::kNv12 || layout == PixelLayout::kNv21;
  if (halved && planes.size() == 1) {
    const std::size_t luma = std::size_t{stream.stride} * stream.size.height;
    const auto all = planes[0].bytes;
    const std::size_t chroma = apart ? luma / 4 : luma / 2;
    if (all.size() >= luma + (apart ? 2 : 1) * chroma) {
      planes = {{all.first(luma), stream.stride}, {all.subspan(luma, chroma), stream.stride}};
      if (apart) planes.push_back({all.subspan(luma + chroma, chroma), stream.stride});
    }
  }
  if (apart) {
    for (std::size_t i = 1; i < planes.size(); ++i) planes[i].stride = stream.stride / 2;
  }
  return planes;
}

}  // namespace perdure::capture
