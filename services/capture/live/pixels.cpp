#include "services/capture/live/pixels.h"

#include <algorithm>
#include <iterator>
#include <opencv2/imgproc.hpp>
#include <string_view>

#include "common/vision/decode.h"

namespace perdure::capture {
namespace {

/// A layout with one plane, and OpenCV's codes of its conversions; -1: no conversion is needed.
struct OnePlane {
  PixelLayout layout;
  int bytes;  ///< bytes per pixel
  int to_grey, to_colour;
};
constexpr OnePlane kOnePlane[] = {
    {PixelLayout::kGrey, 1, -1, cv::COLOR_GRAY2BGR},
    {PixelLayout::kBgr, 3, cv::COLOR_BGR2GRAY, -1},
    {PixelLayout::kRgb, 3, cv::COLOR_RGB2GRAY, cv::COLOR_RGB2BGR},
    {PixelLayout::kBgrx, 4, cv::COLOR_BGRA2GRAY, cv::COLOR_BGRA2BGR},
    {PixelLayout::kRgbx, 4, cv::COLOR_RGBA2GRAY, cv::COLOR_RGBA2BGR},
    {PixelLayout::kYuyv, 2, cv::COLOR_YUV2GRAY_YUY2, cv::COLOR_YUV2BGR_YUY2},
    {PixelLayout::kUyvy, 2, cv::COLOR_YUV2GRAY_UYVY, cv::COLOR_YUV2BGR_UYVY}};

/// Returns nullptr for JPEG, and for layouts with separate colour planes, which have half the size.
const OnePlane* onePlaneOf(PixelLayout layout) {
  const auto* found = std::ranges::find(kOnePlane, layout, &OnePlane::layout);
  return found == std::end(kOnePlane) ? nullptr : found;
}

/// Returns the plane as an OpenCV matrix without a copy. The constructor takes mutable bytes, but
/// they are only read.
cv::Mat view(const ImagePlane& plane, int rows, int columns, int channels) {
  return {rows, columns, CV_8UC(channels), const_cast<std::uint8_t*>(plane.bytes.data()),
          plane.stride};
}

bool holds(const ImagePlane& plane, std::size_t rows, std::size_t row_bytes) {
  return plane.stride >= row_bytes && rows > 0 &&
         plane.bytes.size() >= (rows - 1) * plane.stride + row_bytes;
}

bool suffices(PixelLayout layout, std::size_t width, std::size_t height,
              const std::vector<ImagePlane>& planes) {
  if (const OnePlane* one = onePlaneOf(layout)) {
    return planes.size() == 1 &&
           holds(planes[0], height, width * static_cast<std::size_t>(one->bytes));
  }
  const bool apart = layout == PixelLayout::kYuv420;
  bool enough = planes.size() == (apart ? 3U : 2U) && holds(planes[0], height, width);
  for (std::size_t i = 1; enough && i < planes.size(); ++i) {
    enough = holds(planes[i], height / 2, apart ? width / 2 : width);
  }
  return enough;
}

cv::Mat fromThreePlanes(int width, int height, const std::vector<ImagePlane>& planes, bool grey) {
  cv::Mat y = view(planes[0], height, width, 1);
  if (grey) return y.clone();
  const cv::Mat halves[] = {view(planes[1], height / 2, width / 2, 1),
                            view(planes[2], height / 2, width / 2, 1)};
  cv::Mat uv, colour;
  cv::merge(halves, 2, uv);
  cv::cvtColorTwoPlane(y, uv, colour, cv::COLOR_YUV2BGR_NV12);
  return colour;
}

cv::Mat fromTwoPlanes(PixelLayout layout, int width, int height,
                      const std::vector<ImagePlane>& planes, bool grey) {
  const cv::Mat y = view(planes[0], height, width, 1);
  if (grey) return y.clone();
  cv::Mat colour;
  cv::cvtColorTwoPlane(
      y, view(planes[1], height / 2, width / 2, 2), colour,
      layout == PixelLayout::kNv12 ? cv::COLOR_YUV2BGR_NV12 : cv::COLOR_YUV2BGR_NV21);
  return colour;
}

cv::Mat fromOnePlane(const OnePlane& layout, int width, int height, const ImagePlane& plane,
                     bool grey) {
  const cv::Mat image = view(plane, height, width, layout.bytes);
  const int code = grey ? layout.to_grey : layout.to_colour;
  if (code < 0) return image.clone();
  cv::Mat converted;
  cv::cvtColor(image, converted, code);
  return converted;
}

Result<cv::Mat> decodeJpeg(const std::vector<ImagePlane>& planes, cv::Size size, bool grey) {
  if (planes.size() != 1 || planes[0].bytes.empty()) return fail("image_truncated", "no bytes");
  const auto& bytes = planes[0].bytes;
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  auto image = vision::decodeImage(text, grey ? ImageEncoding::kMono8 : ImageEncoding::kBgr8);
  if (!image) return image;
  if (image->size() != size) return fail("image_size", "a JPEG of another size than agreed");
  return image;
}

}  // namespace

Result<Frame> packed(PixelLayout layout, std::uint32_t width, std::uint32_t height,
                     const std::vector<ImagePlane>& planes, const std::string& wanted) {
  const bool grey = wanted == "mono8" || (wanted == "as_is" && layout == PixelLayout::kGrey);
  const int w = static_cast<int>(width), h = static_cast<int>(height);
  cv::Mat image;
  if (layout == PixelLayout::kJpeg) {
    auto decoded = decodeJpeg(planes, {w, h}, grey);
    if (!decoded) return tl::unexpected(decoded.error());
    image = *decoded;
  } else {
    const OnePlane* one = onePlaneOf(layout);
    const bool even = width % 2 == 0 && (one || height % 2 == 0);
    if ((!one || one->bytes == 2) && !even) {
      return fail("image_size", "an odd size of a format with halved colours");
    }
    if (!suffices(layout, width, height, planes)) {
      return fail("image_truncated", "a buffer is shorter than its image");
    }
    image = one                              ? fromOnePlane(*one, w, h, planes[0], grey)
            : layout == PixelLayout::kYuv420 ? fromThreePlanes(w, h, planes, grey)
                                             : fromTwoPlanes(layout, w, h, planes, grey);
  }
  Frame frame;
  frame.width = width;
  frame.height = height;
  frame.encoding = grey ? ImageEncoding::kMono8 : ImageEncoding::kBgr8;
  frame.data = std::make_shared<const std::vector<std::uint8_t>>(
      image.data, image.data + image.total() * image.elemSize());
  return frame;
}

}  // namespace perdure::capture
