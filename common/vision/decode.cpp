#include "common/vision/decode.h"

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>

namespace perdure::vision {
namespace {

using std::string_view_literals::operator""sv;

/// libjpeg fills missing data with grey and reports success. The end marks are checked instead.
bool endsAsItShould(std::string_view bytes) {
  constexpr std::string_view kJpegStart = "\xFF\xD8"sv, kJpegEnd = "\xFF\xD9"sv;
  constexpr std::string_view kPngStart = "\x89PNG"sv, kPngEnd = "IEND\xAE\x42\x60\x82"sv;
  constexpr std::size_t kTrailing = 64;  // writers may add padding after the end mark
  const auto tail = bytes.substr(bytes.size() - std::min(bytes.size(), kTrailing));
  if (bytes.starts_with(kJpegStart)) return tail.find(kJpegEnd) != tail.npos;
  if (bytes.starts_with(kPngStart)) return tail.find(kPngEnd) != tail.npos;
  return true;
}

int readFlags(std::optional<ImageEncoding> encoding) {
  if (!encoding) return cv::IMREAD_ANYCOLOR;
  return *encoding == ImageEncoding::kBgr8 ? cv::IMREAD_COLOR : cv::IMREAD_GRAYSCALE;
}

constexpr std::size_t kDepthOfPng = 24;
constexpr int kSixteenGrey = cv::IMREAD_ANYDEPTH | cv::IMREAD_GRAYSCALE;

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

Result<cv::Mat> decodeImage(std::string_view bytes, std::optional<ImageEncoding> encoding,
                            int bits) {
  if (bytes.empty()) return fail("image_truncated", "the file is empty");
  if (!endsAsItShould(bytes)) return fail("image_truncated", "the end of the image is missing");
  auto* data = const_cast<char*>(bytes.data());
  const cv::Mat raw(1, static_cast<int>(bytes.size()), CV_8UC1, data);
  cv::Mat image;
  try {
    const bool scaled = bits < 16;
    image = cv::imdecode(raw, readFlags(encoding) | (scaled ? cv::IMREAD_ANYDEPTH : 0));
    if (image.depth() == CV_16U) image.convertTo(image, CV_8U, 1.0 / (1 << (bits - 8)));
  } catch (const cv::Exception& error) {
    return fail("image_corrupt", error.what());
  }
  if (image.empty()) return fail("image_corrupt", "not an image that OpenCV can decode");
  return image;
}

Result<cv::Mat> decodeImageFile(const std::string& path, std::optional<ImageEncoding> encoding,
                                int bits) {
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  const auto size = file ? std::streamoff(file.tellg()) : -1;
  if (size < 0 || std::filesystem::is_directory(path)) {
    return fail("image_missing", path + " cannot be read");
  }
  std::string bytes(static_cast<std::size_t>(size), '\0');
  file.seekg(0).read(bytes.data(), size);
  bytes.resize(static_cast<std::size_t>(file.gcount()));
  auto image = decodeImage(bytes, encoding, bits);
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
  if (!std::filesystem::is_regular_file(path)) return 16;  // OpenCV would print an error to stderr
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
