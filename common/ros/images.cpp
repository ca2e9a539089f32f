#include "common/ros/images.h"

#include <fmt/format.h>

#include <bit>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "common/ros/frames.h"
#include "common/vision/image.h"

namespace perdure::ros {
namespace {

/// The memory layout of a ROS encoding, and its conversion to BGR or grey.
struct PixelForm {
  const char* name;
  int type;
  std::optional<int> conversion = {};
};

const PixelForm kEncodings[] = {
    {"mono8", CV_8UC1},
    {"8UC1", CV_8UC1},
    {"bgr8", CV_8UC3},
    {"8UC3", CV_8UC3},
    {"rgb8", CV_8UC3, cv::COLOR_RGB2BGR},
    {"bgra8", CV_8UC4, cv::COLOR_BGRA2BGR},
    {"8UC4", CV_8UC4, cv::COLOR_BGRA2BGR},
    {"rgba8", CV_8UC4, cv::COLOR_RGBA2BGR},
    {"mono16", CV_16UC1},
    {"16UC1", CV_16UC1},
    // OpenCV names a Bayer pattern by its second row.
    {"bayer_rggb8", CV_8UC1, cv::COLOR_BayerBG2BGR},
    {"bayer_bggr8", CV_8UC1, cv::COLOR_BayerRG2BGR},
    {"bayer_gbrg8", CV_8UC1, cv::COLOR_BayerGR2BGR},
    {"bayer_grbg8", CV_8UC1, cv::COLOR_BayerGB2BGR},
    {"yuv422", CV_8UC2, cv::COLOR_YUV2BGR_UYVY},
    {"uyvy", CV_8UC2, cv::COLOR_YUV2BGR_UYVY},
    {"yuv422_yuy2", CV_8UC2, cv::COLOR_YUV2BGR_YUY2},
    {"yuyv", CV_8UC2, cv::COLOR_YUV2BGR_YUY2},
};

std::string knownEncodings() {
  std::string names;
  for (const PixelForm& one : kEncodings)
    names += (names.empty() ? "" : ", ") + std::string(one.name);
  return names;
}

Result<const PixelForm*> encodingOf(const Image& image) {
  for (const PixelForm& one : kEncodings) {
    if (image.encoding == one.name) return &one;
  }
  return fail("image_encoding", "images are `{}`; {} are read", image.encoding, knownEncodings());
}

Result<cv::Mat> rowsOf(const Image& image, const PixelForm& encoding) {
  const std::uint64_t least = std::uint64_t{image.width} * CV_ELEM_SIZE(encoding.type);
  const std::uint64_t bytes = std::uint64_t{image.step} * image.height;
  const bool sized = image.width > 0 && image.height > 0 && image.width <= 65535 &&
                     image.height <= 65535 && image.step >= least &&
                     image.step % CV_ELEM_SIZE1(encoding.type) == 0;
  const bool halves = CV_MAT_CN(encoding.type) != 2 || image.width % 2 == 0;
  if (!sized || !halves || image.data == nullptr || image.data->size() < bytes) {
    return fail("image_malformed",
                "an image of {}x{} ({}), {} bytes a row, does not fit its {} bytes", image.width,
                image.height, image.encoding, image.step, image.data->size());
  }
  auto* pixels = const_cast<std::uint8_t*>(image.data->data());
  return cv::Mat(static_cast<int>(image.height), static_cast<int>(image.width), encoding.type,
                 pixels, image.step);
}

/// Converts 16-bit values to the byte order of this machine.
cv::Mat inOrder(const cv::Mat& rows, bool bigendian) {
  if (bigendian == (std::endian::native == std::endian::big)) return rows;
  cv::Mat swapped = rows.clone();
  swapped.forEach<std::uint16_t>([](std::uint16_t& value, const int*) {
    value = static_cast<std::uint16_t>((value << 8) | (value >> 8));
  });
  return swapped;
}

}  // namespace

Result<Frame> frameOf(const Image& image, int bits) {
  const auto encoding = encodingOf(image);
  if (!encoding) return tl::unexpected(encoding.error());
  const auto rows = rowsOf(image, **encoding);
  if (!rows) return tl::unexpected(rows.error());
  Frame frame;
  const bool as_it_is = !(*encoding)->conversion && rows->depth() == CV_8U;
  if (as_it_is && rows->isContinuous()) {
    frame.width = image.width, frame.height = image.height;
    frame.encoding = rows->channels() == 3 ? ImageEncoding::kBgr8 : ImageEncoding::kMono8;
    const std::size_t size = rows->total() * rows->elemSize();
    frame.data = image.data->size() == size ? image.data
                                            : SharedBytes(std::make_shared<SharedBytes>(image.data),
                                                          image.data->first(size));
    return frame;
  }
  cv::Mat pixels = *rows;
  if ((*encoding)->conversion) cv::cvtColor(*rows, pixels, *(*encoding)->conversion);
  if (rows->depth() == CV_16U)
    inOrder(*rows, image.is_bigendian != 0).convertTo(pixels, CV_8U, 1.0 / (1 << (bits - 8)));
  const auto set = vision::setPixels(frame, pixels);
  return set ? Result<Frame>(frame) : tl::unexpected(set.error());
}

Image imageOf(const Frame& frame) {
  Image image;
  image.header = headerOf(frame.stamp.time, opticalFrame(frame.camera));
  image.width = frame.width, image.height = frame.height;
  image.encoding = channelsOf(frame.encoding) == 3 ? "bgr8" : "mono8";
  image.step = frame.width * channelsOf(frame.encoding);
  image.data = frame.data;
  return image;
}

CompressedImage compressedOf(const Frame& frame) {
  const std::string colours = channelsOf(frame.encoding) == 3 ? "bgr8" : "mono8";
  return {headerOf(frame.stamp.time, opticalFrame(frame.camera)),
          colours + "; jpeg compressed " + colours, frame.data};
}

int usedBits(const Image& image) {
  const auto encoding = encodingOf(image);
  const auto rows = encoding ? rowsOf(image, **encoding) : fail("image_encoding");
  if (!rows || rows->depth() != CV_16U) return 16;
  double brightest = 0.0;
  cv::minMaxLoc(inOrder(*rows, image.is_bigendian != 0), nullptr, &brightest);
  for (int bits = 8; bits < 16; bits += 2) {
    if (brightest < (1 << bits)) return bits;
  }
  return 16;
}

}  // namespace perdure::ros
