#include "common/vision/decode.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>

#include "common/base/files/text_mode.h"

namespace perdure::vision {
namespace {

using std::string_view_literals::operator""sv;

/// Byte `at` as a number; 0 after the end.
std::size_t byteAt(std::string_view bytes, std::size_t at) {
  return at < bytes.size() ? static_cast<unsigned char>(bytes[at]) : 0;
}

/// Returns whether a JPEG has an end mark after its segments. A thumbnail's end mark lies inside a
/// segment and does not count. Bytes after the end mark (padding, a vendor's trailer) are not read.
bool hasJpegEnd(std::string_view bytes) {
  constexpr std::size_t kEnd = 0xD9, kFirstOfNoLength = 0xD0;
  for (std::size_t at = 2; at + 1 < bytes.size();) {
    const std::size_t mark = byteAt(bytes, at + 1);
    const bool is_mark = byteAt(bytes, at) == 0xFF && mark != 0 && mark != 0xFF;
    if (is_mark && mark == kEnd) return true;
    if (is_mark && (mark < kFirstOfNoLength || mark > kEnd)) {
      at += 2 + std::max<std::size_t>(2, 256 * byteAt(bytes, at + 2) + byteAt(bytes, at + 3));
    } else {  // compressed data, up to the next mark
      at = std::min(bytes.find('\xFF', at + (is_mark ? 2 : 1)), bytes.size());
    }
  }
  return false;
}

bool hasPngEnd(std::string_view bytes) {
  for (std::size_t at = 8; at + 12 <= bytes.size();) {
    if (bytes.substr(at + 4, 4) == "IEND") return true;
    std::size_t length = 0;
    for (std::size_t i = 0; i < 4; ++i) length = 256 * length + byteAt(bytes, at + i);
    at += 12 + length;
  }
  return false;
}

/// Checks the end marks, because libjpeg fills missing data with grey and reports success.
bool endsAsItShould(std::string_view bytes) {
  if (bytes.starts_with("\xFF\xD8"sv)) return hasJpegEnd(bytes);
  return !bytes.starts_with("\x89PNG"sv) || hasPngEnd(bytes);
}

/// Reads the pixels as the sensor gave them: an orientation tag (EXIF) does not turn them.
constexpr int kAsSensed = cv::IMREAD_IGNORE_ORIENTATION;

int readFlags(std::optional<ImageEncoding> encoding) {
  if (!encoding) return kAsSensed | cv::IMREAD_ANYCOLOR;
  return kAsSensed | (*encoding == ImageEncoding::kBgr8 ? cv::IMREAD_COLOR : cv::IMREAD_GRAYSCALE);
}

int reducedBy(int factor) {
  if (factor == 1) return 0;
  return factor == 2   ? cv::IMREAD_REDUCED_GRAYSCALE_2
         : factor == 4 ? cv::IMREAD_REDUCED_GRAYSCALE_4
                       : cv::IMREAD_REDUCED_GRAYSCALE_8;
}

constexpr std::size_t kDepthOfPng = 24;
constexpr int kSixteenGrey = kAsSensed | cv::IMREAD_ANYDEPTH | cv::IMREAD_GRAYSCALE;

std::string headOf(const std::string& path) {
  std::string head(kDepthOfPng + 1, '\0');
  std::ifstream(path, std::ios::binary)
      .read(head.data(), static_cast<std::streamsize>(head.size()));
  return head;
}

/// Returns true if the header is that of a JPEG or an 8-bit PNG. Other formats must be decoded.
bool hasEightBits(std::string_view bytes) {
  if (bytes.starts_with("\xFF\xD8")) return true;
  return bytes.starts_with("\x89PNG") && bytes.size() > kDepthOfPng && bytes[kDepthOfPng] <= 8;
}

int bitsOf(const cv::Mat& image) {
  if (image.empty() || image.depth() != CV_16U) return 16;
  double brightest = 0.0;
  cv::minMaxLoc(image, nullptr, &brightest);
  for (int bits = 8; bits < 16; bits += 2) {
    if (brightest < (1 << bits)) return bits;
  }
  return 16;
}

}  // namespace

Result<cv::Mat> decodeImage(std::string_view bytes, std::optional<ImageEncoding> encoding, int bits,
                            int reduce) {
  if (bytes.empty()) return fail("image_truncated", "the file is empty");
  if (wasCopiedAsText(bytes)) return fail("image_corrupt", std::string("it ") + kCopiedAsText);
  if (!endsAsItShould(bytes)) return fail("image_truncated", "the end of the image is missing");
  auto* data = const_cast<char*>(bytes.data());
  const cv::Mat raw(1, static_cast<int>(bytes.size()), CV_8UC1, data);
  cv::Mat image;
  try {
    const bool scaled = bits < 16;
    image = cv::imdecode(
        raw, readFlags(encoding) | reducedBy(reduce) | (scaled ? cv::IMREAD_ANYDEPTH : 0));
    if (image.depth() == CV_16U) image.convertTo(image, CV_8U, 1.0 / (1 << (bits - 8)));
  } catch (const cv::Exception& error) {
    return fail("image_corrupt", error.what());
  }
  if (image.empty()) return fail("image_corrupt", "not an image that OpenCV can decode");
  return image;
}

Result<cv::Mat> decodeImageFile(const std::string& path, std::optional<ImageEncoding> encoding,
                                int bits, int reduce) {
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  const auto size = file ? std::streamoff(file.tellg()) : -1;
  if (size < 0 || std::filesystem::is_directory(path)) {
    return fail("image_missing", path + " cannot be read");
  }
  std::string bytes(static_cast<std::size_t>(size), '\0');
  file.seekg(0).read(bytes.data(), size);
  bytes.resize(static_cast<std::size_t>(file.gcount()));
  auto image = decodeImage(bytes, encoding, bits, reduce);
  if (!image) return fail(image.error().code, path + ": " + image.error().detail);
  return image;
}

Result<cv::Mat> decodeDepthFile(const std::string& path) {
  if (!std::filesystem::is_regular_file(path)) {
    return fail("image_missing", path + " cannot be read");
  }
  cv::Mat depth;
  try {
    depth = cv::imread(path, cv::IMREAD_UNCHANGED);
  } catch (const cv::Exception& error) {
    return fail("image_corrupt", path + ": " + error.what());
  }
  if (depth.empty()) return fail("image_corrupt", path + ": not an image that OpenCV can decode");
  if (depth.type() != CV_16UC1) {
    return fail("image_depth", path + ": a depth image has one channel of 16 bits");
  }
  return depth;
}

int usedBits(const std::string& path) {
  // otherwise OpenCV prints an error to stderr
  if (!std::filesystem::is_regular_file(path) || !std::ifstream(path)) return 16;
  if (hasEightBits(headOf(path))) return 16;
  try {
    return bitsOf(cv::imread(path, kSixteenGrey));
  } catch (const cv::Exception&) {
    return 16;
  }
}

int usedBitsIn(std::string_view bytes) {
  if (bytes.empty() || hasEightBits(bytes) || !endsAsItShould(bytes)) return 16;
  auto* data = const_cast<char*>(bytes.data());
  try {
    return bitsOf(
        cv::imdecode(cv::Mat(1, static_cast<int>(bytes.size()), CV_8UC1, data), kSixteenGrey));
  } catch (const cv::Exception&) {
    return 16;
  }
}

}  // namespace perdure::vision
