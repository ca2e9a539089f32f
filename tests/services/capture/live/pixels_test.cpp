#include "services/capture/live/pixels.h"

#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

namespace perdure::capture {
namespace {

constexpr int kWidth = 32, kHeight = 16, kPadding = 24;

/// A smooth image, so that chroma subsampling loses little: red increases to the right, green
/// downwards.
cv::Mat picture() {
  cv::Mat image(kHeight, kWidth, CV_8UC3);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      image.at<cv::Vec3b>(y, x) =
          cv::Vec3b(60, static_cast<uchar>(60 + 6 * y), static_cast<uchar>(70 + 4 * x));
    }
  }
  return image;
}

/// A plane with padded rows, as drivers give it.
struct Padded {
  std::vector<std::uint8_t> bytes;
  std::size_t stride;
  explicit Padded(const cv::Mat& image) : stride(image.cols * image.elemSize() + kPadding) {
    bytes.assign(stride * static_cast<std::size_t>(image.rows), 0xEE);
    for (int y = 0; y < image.rows; ++y) {
      std::copy_n(image.ptr(y), image.cols * image.elemSize(),
                  bytes.begin() + static_cast<std::ptrdiff_t>(stride) * y);
    }
  }
  ImagePlane plane() const { return {bytes, stride}; }
};

cv::Mat matOf(const Frame& frame) {
  const int type = frame.encoding == ImageEncoding::kBgr8 ? CV_8UC3 : CV_8UC1;
  return cv::Mat(static_cast<int>(frame.height), static_cast<int>(frame.width), type,
                 const_cast<std::uint8_t*>(frame.data->data()))
      .clone();
}

/// Returns the largest difference of a channel from the picture.
double differenceFrom(const cv::Mat& expected, const Frame& frame) {
  return cv::norm(expected, matOf(frame), cv::NORM_INF);
}

cv::Mat converted(int code) {
  cv::Mat result;
  cv::cvtColor(picture(), result, code);
  return result;
}

void expectPicture(PixelLayout layout, const std::vector<ImagePlane>& planes, double colour,
                   double grey) {
  const auto bgr = packed(layout, kWidth, kHeight, planes, "as_is");
  ASSERT_TRUE(bgr) << bgr.error().detail;
  EXPECT_EQ(bgr->encoding, ImageEncoding::kBgr8);
  EXPECT_LE(differenceFrom(picture(), *bgr), colour);
  const auto mono = packed(layout, kWidth, kHeight, planes, "mono8");
  ASSERT_TRUE(mono) << mono.error().detail;
  EXPECT_EQ(mono->encoding, ImageEncoding::kMono8);
  EXPECT_LE(differenceFrom(converted(cv::COLOR_BGR2GRAY), *mono), grey);
}

TEST(Pixels, OfPackedColoursAreExact) {
  expectPicture(PixelLayout::kBgr, {Padded(picture()).plane()}, 0, 0);
  const Padded rgb(converted(cv::COLOR_BGR2RGB)), bgrx(converted(cv::COLOR_BGR2BGRA)),
      rgbx(converted(cv::COLOR_BGR2RGBA));
  expectPicture(PixelLayout::kRgb, {rgb.plane()}, 0, 1);
  expectPicture(PixelLayout::kBgrx, {bgrx.plane()}, 0, 1);
  expectPicture(PixelLayout::kRgbx, {rgbx.plane()}, 0, 1);
}

/// In video range, 16 to 235 represent black to white; grey is Y unchanged.
constexpr double kHalved = 8, kVideoRange = 20;

TEST(Pixels, OfPlanesWithHalvedColours) {
  cv::Mat i420;
  cv::cvtColor(picture(), i420, cv::COLOR_BGR2YUV_I420);
  const cv::Mat y = i420.rowRange(0, kHeight).clone();
  const cv::Mat u(kHeight / 2, kWidth / 2, CV_8U, i420.ptr(kHeight));
  const cv::Mat v(kHeight / 2, kWidth / 2, CV_8U, i420.ptr(kHeight) + u.total());
  cv::Mat uv, vu;
  cv::merge(std::vector<cv::Mat>{u, v}, uv);
  cv::merge(std::vector<cv::Mat>{v, u}, vu);
  const Padded py(y), pu(u), pv(v), puv(uv), pvu(vu);
  expectPicture(PixelLayout::kYuv420, {py.plane(), pu.plane(), pv.plane()}, kHalved, kVideoRange);
  expectPicture(PixelLayout::kNv12, {py.plane(), puv.plane()}, kHalved, kVideoRange);
  expectPicture(PixelLayout::kNv21, {py.plane(), pvu.plane()}, kHalved, kVideoRange);
  cv::Mat yuyv(kHeight, kWidth, CV_8UC2), uyvy(kHeight, kWidth, CV_8UC2);
  for (int r = 0; r < kHeight; ++r) {
    for (int c = 0; c < kWidth; ++c) {
      const uchar colour = (c % 2 == 0 ? u : v).at<uchar>(r / 2, c / 2);
      yuyv.at<cv::Vec2b>(r, c) = {y.at<uchar>(r, c), colour};
      uyvy.at<cv::Vec2b>(r, c) = {colour, y.at<uchar>(r, c)};
    }
  }
  expectPicture(PixelLayout::kYuyv, {Padded(yuyv).plane()}, kHalved, kVideoRange);
  expectPicture(PixelLayout::kUyvy, {Padded(uyvy).plane()}, kHalved, kVideoRange);
}

TEST(Pixels, OfJpegAndGrey) {
  std::vector<std::uint8_t> jpeg;
  ASSERT_TRUE(cv::imencode(".jpg", picture(), jpeg, {cv::IMWRITE_JPEG_QUALITY, 98}));
  expectPicture(PixelLayout::kJpeg, {{jpeg, 0}}, 12, 4);
  const Padded grey(converted(cv::COLOR_BGR2GRAY));
  const auto frame = packed(PixelLayout::kGrey, kWidth, kHeight, {grey.plane()}, "as_is");
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->encoding, ImageEncoding::kMono8);
  EXPECT_EQ(differenceFrom(converted(cv::COLOR_BGR2GRAY), *frame), 0);
  EXPECT_EQ(packed(PixelLayout::kGrey, kWidth, kHeight, {grey.plane()}, "bgr8")->encoding,
            ImageEncoding::kBgr8);
}

std::string reasonOf(const Result<Frame>& result) { return result ? "none" : result.error().code; }

TEST(Pixels, OfBrokenBuffersAreRefused) {
  const Padded bgr(picture());
  for (const std::size_t bytes :
       {std::size_t{0}, std::size_t{1}, bgr.bytes.size() - 1 - kPadding}) {
    const ImagePlane cut{std::span(bgr.bytes).first(bytes), bgr.stride};
    EXPECT_EQ(reasonOf(packed(PixelLayout::kBgr, kWidth, kHeight, {cut}, "as_is")),
              "image_truncated");
  }
  const std::span<const std::uint8_t> all(bgr.bytes);
  EXPECT_EQ(reasonOf(packed(PixelLayout::kBgr, kWidth, kHeight, {{all, 5}}, "as_is")),
            "image_truncated");
  EXPECT_EQ(reasonOf(packed(PixelLayout::kNv12, kWidth, kHeight, {{all, 32}}, "as_is")),
            "image_truncated");
  EXPECT_EQ(reasonOf(packed(PixelLayout::kYuyv, 31, kHeight, {{all, 128}}, "as_is")), "image_size");
  EXPECT_EQ(reasonOf(packed(PixelLayout::kJpeg, kWidth, kHeight, {{all, 0}}, "as_is")),
            "image_corrupt");
  std::vector<std::uint8_t> other;
  ASSERT_TRUE(cv::imencode(".jpg", cv::Mat(8, 8, CV_8UC3, cv::Scalar(9, 9, 9)), other));
  EXPECT_EQ(reasonOf(packed(PixelLayout::kJpeg, kWidth, kHeight, {{other, 0}}, "as_is")),
            "image_size");
}

}  // namespace
}  // namespace perdure::capture
