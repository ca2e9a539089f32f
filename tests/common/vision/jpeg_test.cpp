#include "common/vision/jpeg.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <random>

#include "common/vision/image.h"

namespace perdure::vision {
namespace {

constexpr std::uint32_t kWidth = 96, kHeight = 64;

/// A smooth picture, which JPEG compresses well.
Frame picture(ImageEncoding encoding) {
  const std::uint32_t channels = channelsOf(encoding);
  std::vector<std::uint8_t> pixels;
  for (std::uint32_t y = 0; y < kHeight; ++y) {
    for (std::uint32_t x = 0; x < kWidth; ++x) {
      for (std::uint32_t c = 0; c < channels; ++c) {
        pixels.push_back(static_cast<std::uint8_t>(40 + x + y + 20 * c));
      }
    }
  }
  Frame frame;
  frame.camera = "cam0";
  frame.stamp.sequence = 17;
  frame.width = kWidth;
  frame.height = kHeight;
  frame.encoding = encoding;
  frame.data = std::make_shared<const std::vector<std::uint8_t>>(std::move(pixels));
  return frame;
}

Frame withBytes(Frame frame, std::vector<std::uint8_t> bytes) {
  frame.data = std::make_shared<const std::vector<std::uint8_t>>(std::move(bytes));
  return frame;
}

std::vector<std::uint8_t> bytesOf(const Frame& frame) {
  return {frame.data->begin(), frame.data->end()};
}

TEST(Jpeg, GivesBackThePictureWithinTwoGreyLevelsAndAllElseUnchanged) {
  for (const auto encoding : {ImageEncoding::kMono8, ImageEncoding::kBgr8}) {
    const Frame frame = picture(encoding);
    const auto small = compressed(frame, 95);
    ASSERT_TRUE(small) << small.error().detail;
    EXPECT_TRUE(isCompressed(small->encoding));
    EXPECT_LT(small->data->size(), frame.data->size() / 4);
    EXPECT_FALSE(viewOf(*small)) << "nobody takes it for pixels";
    const auto back = decompressed(*small);
    ASSERT_TRUE(back) << back.error().detail;
    EXPECT_EQ(back->encoding, encoding);
    EXPECT_EQ(back->stamp.sequence, 17u);
    ASSERT_EQ(back->data->size(), frame.data->size());
    double sum = 0.0;
    for (std::size_t i = 0; i < frame.data->size(); ++i) {
      sum += std::abs(int{(*frame.data)[i]} - int{(*back->data)[i]});
    }
    EXPECT_LT(sum / static_cast<double>(frame.data->size()), 2.0);
  }
}

TEST(Jpeg, GivesGreyOfColours) {
  const auto grey =
      decompressed(*compressed(picture(ImageEncoding::kBgr8), 95), ImageEncoding::kMono8);
  ASSERT_TRUE(grey);
  EXPECT_EQ(grey->encoding, ImageEncoding::kMono8);
  const auto expected = monoOf(picture(ImageEncoding::kBgr8));
  EXPECT_NEAR((*grey->data)[kWidth * 30 + 50], expected->at<std::uint8_t>(30, 50), 3);
}

TEST(Jpeg, LeavesRawPixelsAlone) {
  const Frame frame = picture(ImageEncoding::kMono8);
  EXPECT_EQ(decompressed(frame)->data->data(), frame.data->data());
  const auto small = compressed(frame, 80);
  EXPECT_EQ(compressed(*small, 10)->data->data(), small->data->data());
}

TEST(Jpeg, RefusesWhatIsCutShortOfAnotherSizeOrNone) {
  const Frame small = *compressed(picture(ImageEncoding::kMono8), 90);
  const auto whole = bytesOf(small);
  for (const std::size_t length :
       {whole.size() - 2, whole.size() / 2, std::size_t{20}, std::size_t{2}, std::size_t{0}}) {
    const auto cut = decompressed(
        withBytes(small, {whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(length)}));
    ASSERT_FALSE(cut) << length;
    EXPECT_EQ(cut.error().code, "jpeg_malformed");
  }
  EXPECT_EQ(decompressed(withBytes(small, std::vector<std::uint8_t>(500, 7))).error().code,
            "jpeg_malformed");
  Frame other = small;
  other.width = 16384;
  EXPECT_EQ(decompressed(other).error().code, "jpeg_size_wrong");
  Frame none = small;
  none.data = nullptr;
  EXPECT_EQ(decompressed(none).error().code, "image_missing");
}

TEST(Jpeg, SurvivesBytesThatAreTurned) {
  const Frame small = *compressed(picture(ImageEncoding::kBgr8), 90);
  std::mt19937 dice(3);
  int refused = 0;
  for (int i = 0; i < 500; ++i) {
    auto bytes = bytesOf(small);
    for (int k = 0; k < 3; ++k) bytes[dice() % bytes.size()] ^= static_cast<std::uint8_t>(dice());
    const auto back = decompressed(withBytes(small, bytes));
    refused += !back;
    EXPECT_EQ(back ? back->data->size() : 0, back ? std::size_t{kWidth} * kHeight * 3 : 0);
  }
  EXPECT_GT(refused, 0);
}

TEST(Jpeg, RefusesToCompressWhatIsNoImage) {
  Frame frame = picture(ImageEncoding::kMono8);
  frame.height = 1;
  EXPECT_EQ(compressed(frame, 90).error().code, "image_malformed");
  EXPECT_EQ(compressed(Frame{}, 90).error().code, "image_missing");
}

}  // namespace
}  // namespace perdure::vision
