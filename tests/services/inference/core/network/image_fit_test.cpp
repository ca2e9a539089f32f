#include "services/inference/core/network/image_fit.h"

#include <gtest/gtest.h>

namespace perdure::inference {
namespace {

Input input(Fit fit) {
  Input i;
  i.width = 416;
  i.height = 416;
  i.fit = fit;
  return i;
}

Frame frame(std::uint32_t width, std::uint32_t height, ImageEncoding encoding,
            std::vector<std::uint8_t> pixel) {
  Frame f;
  f.width = width;
  f.height = height;
  f.encoding = encoding;
  std::vector<std::uint8_t> data;
  for (std::uint32_t i = 0; i < width * height; ++i) {
    data.insert(data.end(), pixel.begin(), pixel.end());
  }
  f.data = std::make_shared<const std::vector<std::uint8_t>>(std::move(data));
  return f;
}

TEST(ImageFit, ShareOfTheInputThatStaysGrey) {
  EXPECT_NEAR(paddedShare(input(Fit::kLetterboxCentre), 832, 416), 0.5, 1e-9);
  EXPECT_NEAR(paddedShare(input(Fit::kLetterboxTopLeft), 1242, 375), 0.7, 0.01);
  EXPECT_EQ(paddedShare(input(Fit::kLetterboxTopLeft), 500, 500), 0.0);
  Input wide = input(Fit::kLetterboxCentre);
  wide.height = 208;
  EXPECT_EQ(paddedShare(wide, 832, 416), 0.0);
  EXPECT_NEAR(paddedShare(wide, 832, 416, 1), 0.75, 1e-9) << "turned upright";
  EXPECT_EQ(paddedShare(input(Fit::kResize), 1242, 375), 0.0);
}

TEST(ImageFit, LetterboxUsesOneScaleAndResizeTwo) {
  const ImageFit letterbox = fitOf(input(Fit::kLetterboxTopLeft), 1242, 375);
  EXPECT_EQ(letterbox.width, 416);
  EXPECT_EQ(letterbox.height, 125);
  EXPECT_EQ(letterbox.offset_y, 0);
  const ImageFit centre = fitOf(input(Fit::kLetterboxCentre), 1242, 375);
  EXPECT_EQ(centre.offset_y, (416 - 125) / 2);
  const ImageFit resize = fitOf(input(Fit::kResize), 1242, 375);
  EXPECT_EQ(resize.height, 416);
  EXPECT_NE(resize.scale_x, resize.scale_y);
}

TEST(ImageFit, BoxesComeBackToWhereTheyWere) {
  for (const Fit fit : {Fit::kLetterboxTopLeft, Fit::kLetterboxCentre, Fit::kResize}) {
    const ImageFit f = fitOf(input(fit), 1242, 375);
    const Box image{100, 50, 300, 200};
    const Box there{image.x1 * f.scale_x + f.offset_x, image.y1 * f.scale_y + f.offset_y,
                    image.x2 * f.scale_x + f.offset_x, image.y2 * f.scale_y + f.offset_y};
    const Box back = f.toImage(there);
    EXPECT_NEAR(back.x1, image.x1, 1e-9);
    EXPECT_NEAR(back.y1, image.y1, 1e-9);
    EXPECT_NEAR(back.x2, image.x2, 1e-9);
    EXPECT_NEAR(back.y2, image.y2, 1e-9);
  }
}

TEST(ImageFit, BlobHasTheNetworksColourOrderScaleMeanAndPadding) {
  Input in = input(Fit::kLetterboxTopLeft);
  in.width = 8;
  in.height = 8;
  in.rgb = true;
  in.scale = {0.5, 0.25, 2};
  in.mean = {1, 2, 3};
  in.pad = 114;
  const auto blob = makeBlob(in, frame(8, 4, ImageEncoding::kBgr8, {10, 20, 30}));
  ASSERT_TRUE(blob);
  const float* r = blob->ptr<float>();
  EXPECT_FLOAT_EQ(r[0], (30 - 1) * 0.5F);
  EXPECT_FLOAT_EQ(r[64], (20 - 2) * 0.25F);
  EXPECT_FLOAT_EQ(r[128], (10 - 3) * 2.0F);
  EXPECT_FLOAT_EQ(r[63], (114 - 1) * 0.5F) << "the last row is padding";
}

TEST(ImageFit, MonoImagesFillAllChannels) {
  const auto blob = makeBlob(input(Fit::kResize), frame(32, 16, ImageEncoding::kMono8, {77}));
  ASSERT_TRUE(blob);
  for (std::size_t c = 0; c < 3; ++c) EXPECT_FLOAT_EQ(blob->ptr<float>()[c * 416 * 416 + 5], 77.0F);
}

TEST(ImageFit, TurnsPixelsBoxesAndSidesTogetherAndExactlyBack) {
  const Box bright{5, 1, 7, 4};
  Frame image = frame(8, 6, ImageEncoding::kMono8, {0});
  std::vector<std::uint8_t> pixels(8 * 6, 0);
  for (std::size_t y = 1; y < 4; ++y) {
    for (std::size_t x = 5; x < 7; ++x) pixels[8 * y + x] = 200;
  }
  image.data = std::make_shared<const std::vector<std::uint8_t>>(std::move(pixels));
  for (int quarters = 0; quarters < 4; ++quarters) {
    Input in = input(Fit::kResize);  // the input needs no scaling
    in.width = 8, in.height = 6;
    if (quarters % 2 == 1) std::swap(in.width, in.height);
    const Box shown = fitOf(in, 8, 6, quarters).toInput(bright);
    const auto blob = makeBlob(in, image, quarters);
    ASSERT_TRUE(blob);
    for (int y = 0; y < in.height; ++y) {
      for (int x = 0; x < in.width; ++x) {
        const bool inside = x >= shown.x1 && x < shown.x2 && y >= shown.y1 && y < shown.y2;
        EXPECT_EQ(blob->ptr<float>()[y * in.width + x], inside ? 200.0F : 0.0F)
            << quarters << " at " << x << ", " << y;
      }
    }
    const ImageFit fit = fitOf(input(Fit::kLetterboxCentre), 8, 6, quarters);
    const Box back = fit.toImage(fit.toInput(bright));
    EXPECT_DOUBLE_EQ(back.x1, bright.x1);
    EXPECT_DOUBLE_EQ(back.y1, bright.y1);
    EXPECT_DOUBLE_EQ(back.x2, bright.x2);
    EXPECT_DOUBLE_EQ(back.y2, bright.y2);
    const std::array<double, 4> sides{1, 2, 3, 4};
    EXPECT_EQ(fit.toImage(fit.toInput(sides)), sides);
  }
}

TEST(ImageFit, ASideKeepsItsLengthsWhenTheImageIsTurned) {
  const Box box{10, 20, 40, 80};
  const std::array<double, 4> insets{1, 2, 3, 4};
  const Box inner{box.x1 + 1, box.y1 + 2, box.x2 - 3, box.y2 - 4};
  for (int quarters = 0; quarters < 4; ++quarters) {
    const Box outer = turned(box, quarters, 100, 90), small = turned(inner, quarters, 100, 90);
    EXPECT_EQ(turned(insets, quarters),
              (std::array<double, 4>{small.x1 - outer.x1, small.y1 - outer.y1, outer.x2 - small.x2,
                                     outer.y2 - small.y2}));
  }
}

TEST(ImageFit, RefusesAFrameWhoseSizeAndDataDisagree) {
  Frame short_data = frame(32, 16, ImageEncoding::kMono8, {77});
  short_data.encoding = ImageEncoding::kBgr8;
  Frame none = frame(32, 16, ImageEncoding::kMono8, {77});
  none.data = nullptr;
  Frame empty;
  for (const Frame& f : {short_data, none, empty}) {
    const auto blob = makeBlob(input(Fit::kResize), f);
    ASSERT_FALSE(blob);
    EXPECT_EQ(blob.error().code, "frame_malformed");
  }
}

}  // namespace
}  // namespace perdure::inference
