#include "common/vision/jpeg.h"

#include <turbojpeg.h>

#include <memory>
#include <utility>

namespace perdure::vision {
namespace {

struct Destroy {
  void operator()(void* handle) const { tjDestroy(handle); }
};
using Turbo = std::unique_ptr<void, Destroy>;

struct Free {
  void operator()(unsigned char* buffer) const { tjFree(buffer); }
};

int pixelFormat(ImageEncoding encoding) { return channelsOf(encoding) == 3 ? TJPF_BGR : TJPF_GRAY; }

ImageEncoding compressedAs(ImageEncoding encoding) {
  return encoding == ImageEncoding::kBgr8 ? ImageEncoding::kJpegBgr8 : ImageEncoding::kJpegMono8;
}

std::size_t pixelBytes(const Frame& frame, ImageEncoding encoding) {
  return std::size_t{frame.width} * frame.height * channelsOf(encoding);
}

}  // namespace

Result<Frame> compressed(const Frame& frame, int quality) {
  if (isCompressed(frame.encoding)) return frame;
  if (!frame.data) return fail("image_missing", "the frame carries no pixels");
  if (frame.data->empty() || frame.data->size() != pixelBytes(frame, frame.encoding)) {
    return fail("image_malformed", "the frame's size and its number of bytes disagree");
  }
  const Turbo turbo(tjInitCompress());
  const int chroma = frame.encoding == ImageEncoding::kBgr8 ? TJSAMP_420 : TJSAMP_GRAY;
  unsigned char* buffer = nullptr;
  unsigned long size = 0;
  const int failed = tjCompress2(turbo.get(), frame.data->data(), static_cast<int>(frame.width), 0,
                                 static_cast<int>(frame.height), pixelFormat(frame.encoding),
                                 &buffer, &size, chroma, quality, TJFLAG_ACCURATEDCT);
  const std::shared_ptr<unsigned char> keeper(buffer, Free());
  if (failed != 0) return fail("jpeg_failed", tjGetErrorStr2(turbo.get()));
  Frame result = frame;
  result.encoding = compressedAs(frame.encoding);
  result.data = {keeper, std::span<const std::uint8_t>(buffer, size)};
  return result;
}

Result<Frame> decompressed(const Frame& frame, ImageEncoding wanted) {
  if (!isCompressed(frame.encoding)) return frame;
  if (!frame.data) return fail("image_missing", "the frame carries no pixels");
  const Turbo turbo(tjInitDecompress());
  int width = 0, height = 0, chroma = 0, colours = 0;
  const auto* bytes = frame.data->data();
  const auto size = static_cast<unsigned long>(frame.data->size());
  if (tjDecompressHeader3(turbo.get(), bytes, size, &width, &height, &chroma, &colours) != 0 ||
      width < 1 || height < 1) {
    return fail("jpeg_malformed", tjGetErrorStr2(turbo.get()));
  }
  // The size is checked before memory is allocated: the frame's is bounded, but a JPEG may state
  // any size.
  if (std::cmp_not_equal(width, frame.width) || std::cmp_not_equal(height, frame.height)) {
    return fail("jpeg_size_wrong", "the JPEG's width and height are not the frame's");
  }
  auto pixels = std::make_shared<std::vector<std::uint8_t>>(pixelBytes(frame, wanted));
  // TurboJPEG reports truncated data only as a warning and fills the rest with grey.
  if (tjDecompress2(turbo.get(), bytes, size, pixels->data(), width, 0, height, pixelFormat(wanted),
                    TJFLAG_STOPONWARNING | TJFLAG_ACCURATEDCT) != 0) {
    return fail("jpeg_malformed", tjGetErrorStr2(turbo.get()));
  }
  Frame result = frame;
  result.encoding = wanted;
  result.data = std::move(pixels);
  return result;
}

Result<Frame> decompressed(const Frame& frame) {
  return decompressed(
      frame, channelsOf(frame.encoding) == 3 ? ImageEncoding::kBgr8 : ImageEncoding::kMono8);
}

}  // namespace perdure::vision
