// ROS images as frames: every supported encoding, with known pixels.
#include "common/ros/images.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace perdure::ros {
namespace {

using testing::Each;
using testing::ElementsAre;
using testing::HasSubstr;

Image imageOf(const std::string& encoding, std::uint32_t width, std::uint32_t height,
              std::uint32_t step, std::vector<std::uint8_t> bytes) {
  Image image;
  image.encoding = encoding;
  image.width = width, image.height = height, image.step = step;
  image.data = std::make_shared<const std::vector<std::uint8_t>>(std::move(bytes));
  return image;
}

std::vector<std::uint8_t> pixelsOf(const Image& image, int bits = 16) {
  const auto frame = frameOf(image, bits);
  EXPECT_TRUE(frame) << (frame ? "" : frame.error().detail);
  if (!frame) return {};
  return {frame->data->begin(), frame->data->end()};
}

TEST(RosImages, WhatIsAsAFrameHasItIsNotCopied) {
  const Image image = imageOf("mono8", 2, 2, 2, {1, 2, 3, 4});
  const auto frame = frameOf(image);
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->encoding, ImageEncoding::kMono8);
  EXPECT_EQ(frame->data->data(), image.data->data());
}

TEST(RosImages, WhatRowsHaveBehindTheirPixelsIsLeftOut) {
  EXPECT_THAT(pixelsOf(imageOf("mono8", 2, 2, 3, {1, 2, 99, 3, 4, 99})), ElementsAre(1, 2, 3, 4));
}

TEST(RosImages, ColoursBecomeBgr) {
  EXPECT_THAT(pixelsOf(imageOf("bgr8", 1, 1, 3, {1, 2, 3})), ElementsAre(1, 2, 3));
  EXPECT_THAT(pixelsOf(imageOf("rgb8", 1, 1, 3, {1, 2, 3})), ElementsAre(3, 2, 1));
  EXPECT_THAT(pixelsOf(imageOf("rgba8", 1, 1, 4, {1, 2, 3, 9})), ElementsAre(3, 2, 1));
  EXPECT_THAT(pixelsOf(imageOf("bgra8", 1, 1, 4, {1, 2, 3, 9})), ElementsAre(1, 2, 3));
}

/// A red wall: only the red pixels of a Bayer pattern are bright.
TEST(RosImages, BayerPatternsKeepTheirColour) {
  const std::pair<const char*, int> kRedAt[] = {
      {"bayer_rggb8", 0}, {"bayer_grbg8", 1}, {"bayer_gbrg8", 2}, {"bayer_bggr8", 3}};
  for (const auto& [encoding, red_at] : kRedAt) {
    std::vector<std::uint8_t> bytes(64, 0);
    for (int i = 0; i < 64; ++i) {
      if ((i / 8 % 2) * 2 + i % 2 == red_at) bytes[static_cast<std::size_t>(i)] = 200;
    }
    const auto pixels = pixelsOf(imageOf(encoding, 8, 8, 8, bytes));
    ASSERT_EQ(pixels.size(), 192u);
    const std::size_t middle = 3 * (8 * 4 + 4);
    EXPECT_EQ(pixels[middle], 0) << encoding;
    EXPECT_EQ(pixels[middle + 2], 200) << encoding;
  }
}

TEST(RosImages, LuminanceOfYuvIsWhereItsNameSays) {
  EXPECT_THAT(pixelsOf(imageOf("uyvy", 2, 1, 4, {128, 235, 128, 235})), Each(255));
  EXPECT_THAT(pixelsOf(imageOf("yuv422_yuy2", 2, 1, 4, {235, 128, 235, 128})), Each(255));
}

TEST(RosImages, OfSixteenBitsTheUsedOnesAreTaken) {
  Image image = imageOf("mono16", 2, 1, 4, {0x00, 0x04, 0xFF, 0x0F});  // 1024 and 4095
  EXPECT_EQ(usedBits(image), 12);
  EXPECT_THAT(pixelsOf(image, 12), ElementsAre(64, 255));
  image = imageOf("mono16", 2, 1, 4, {0x04, 0x00, 0x0F, 0xFF});
  image.is_bigendian = 1;
  EXPECT_EQ(usedBits(image), 12);
  EXPECT_THAT(pixelsOf(image, 12), ElementsAre(64, 255));
  EXPECT_EQ(usedBits(imageOf("mono8", 1, 1, 1, {255})), 16);
}

TEST(RosImages, WhatCannotBeIsRefused) {
  EXPECT_THAT(frameOf(imageOf("32FC1", 1, 1, 4, {0, 0, 0, 0})).error().detail,
              HasSubstr("`32FC1`; mono8"));
  for (const Image& image :
       {imageOf("mono8", 2, 2, 2, {1, 2, 3}), imageOf("mono8", 2, 2, 1, {1, 2, 3, 4}),
        imageOf("mono8", 0, 2, 2, {1, 2, 3, 4}), imageOf("uyvy", 1, 1, 2, {1, 2}),
        imageOf("bgr8", 70000, 1, 210000, {}), imageOf("mono16", 1, 2, 3, {1, 2, 3, 4, 5, 6})}) {
    EXPECT_EQ(frameOf(image).error().code, "image_malformed");
  }
}

}  // namespace
}  // namespace perdure::ros
