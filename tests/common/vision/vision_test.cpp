#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>

#include "common/vision/decode.h"
#include "common/vision/image.h"

namespace perdure::vision {
namespace {

cv::Mat colours() {
  cv::Mat image(6, 8, CV_8UC3);
  for (int r = 0; r < image.rows; ++r) {
    for (int c = 0; c < image.cols; ++c) {
      image.at<cv::Vec3b>(r, c) = cv::Vec3b(static_cast<uchar>(20 * r), static_cast<uchar>(30 * c),
                                            static_cast<uchar>(10 * (r + c)));
    }
  }
  return image;
}

std::string encoded(const char* extension, const cv::Mat& image) {
  std::vector<uchar> bytes;
  cv::imencode(extension, image, bytes);
  return {bytes.begin(), bytes.end()};
}

TEST(Image, PixelsComeBackAsTheyWentInAlsoFromPaddedRows) {
  const cv::Mat wide = colours();
  const cv::Mat part = wide.colRange(2, 7);
  Frame frame;
  ASSERT_TRUE(setPixels(frame, part));
  EXPECT_EQ(frame.width, 5U);
  EXPECT_EQ(frame.height, 6U);
  EXPECT_EQ(frame.encoding, ImageEncoding::kBgr8);
  EXPECT_EQ(cv::norm(*viewOf(frame), part, cv::NORM_INF), 0.0);
}

TEST(Image, AMonoViewOfAMonoFrameIsNotACopy) {
  Frame frame;
  ASSERT_TRUE(setPixels(frame, cv::Mat(4, 4, CV_8UC1, cv::Scalar(9))));
  EXPECT_EQ(monoOf(frame)->data, frame.data->data());
}

TEST(Image, ColourAndGreyAreConvertedIntoEachOther) {
  Frame frame;
  ASSERT_TRUE(setPixels(frame, cv::Mat(4, 4, CV_8UC3, cv::Scalar(70, 70, 70))));
  const auto mono = monoOf(frame);
  ASSERT_EQ(mono->type(), CV_8UC1);
  EXPECT_EQ(mono->at<uchar>(2, 2), 70);
  ASSERT_TRUE(setPixels(frame, *mono));
  EXPECT_EQ(bgrOf(frame)->at<cv::Vec3b>(1, 1), cv::Vec3b(70, 70, 70));
}

TEST(Image, AFrameWhoseBytesDoNotFitItsSizeIsRefused) {
  Frame frame;
  EXPECT_EQ(viewOf(frame).error().code, "image_missing");
  ASSERT_TRUE(setPixels(frame, cv::Mat(4, 4, CV_8UC1, cv::Scalar(0))));
  frame.width = 5;
  EXPECT_EQ(viewOf(frame).error().code, "image_malformed");
  EXPECT_EQ(setPixels(frame, cv::Mat(2, 2, CV_16UC1)).error().code, "image_malformed");
}

TEST(Decode, ACopyInTextModeIsNamed) {
  cv::Mat noise(200, 200, CV_8UC1);
  cv::RNG(1).fill(noise, cv::RNG::UNIFORM, 0, 256);
  const std::string whole = encoded(".jpg", noise);
  ASSERT_TRUE(decodeImage(whole, std::nullopt));
  std::string copied;
  for (const char byte : whole) copied += byte == '\n' ? "\r\n" : std::string(1, byte);
  const auto image = decodeImage(copied, std::nullopt);
  ASSERT_FALSE(image);
  EXPECT_NE(image.error().detail.find("copied in text mode"), std::string::npos);
}

TEST(Decode, KeepsTheFilesChannelsUnlessToldOtherwise) {
  const std::string colour = encoded(".png", colours());
  const std::string grey = encoded(".png", cv::Mat(3, 3, CV_8UC1, cv::Scalar(5)));
  EXPECT_EQ(decodeImage(colour, std::nullopt)->channels(), 3);
  EXPECT_EQ(decodeImage(colour, ImageEncoding::kMono8)->channels(), 1);
  EXPECT_EQ(decodeImage(grey, std::nullopt)->channels(), 1);
  EXPECT_EQ(decodeImage(grey, ImageEncoding::kBgr8)->channels(), 3);
}

TEST(Decode, ATruncatedImageIsRefusedHoweverMuchOfItIsThere) {
  for (const char* extension : {".png", ".jpg"}) {
    const std::string whole = encoded(extension, colours());
    ASSERT_TRUE(decodeImage(whole, std::nullopt)) << extension;
    for (const std::size_t size :
         {std::size_t{0}, std::size_t{3}, whole.size() / 2, whole.size() - 2}) {
      const auto image = decodeImage(whole.substr(0, size), std::nullopt);
      ASSERT_FALSE(image) << extension << " of " << size << " bytes";
      EXPECT_TRUE(image.error().code == "image_truncated" || size < 4);
    }
  }
}

/// A JPEG with an EXIF orientation tag, and with a thumbnail that has its own end mark.
std::string tagged(const std::string& jpeg, char orientation) {
  std::string exif("Exif\0\0II*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0", 28);
  exif += std::string({orientation, 0, 0, 0, 0, 0, 0, 0}) + "\xFF\xD8\xFF\xD9";
  const std::size_t length = exif.size() + 2;
  return jpeg.substr(0, 2) + "\xFF\xE1" + static_cast<char>(length / 256) +
         static_cast<char>(length % 256) + exif + jpeg.substr(2);
}

TEST(Decode, PixelsAreAsTheSensorGaveThemWhateverTheOrientationTagSays) {
  const std::string plain = encoded(".jpg", cv::Mat(16, 32, CV_8UC1, cv::Scalar(90)));
  for (const char orientation : {1, 3, 6, 8}) {
    for (const auto encoding : {ImageEncoding::kMono8, ImageEncoding::kBgr8}) {
      const auto image = decodeImage(tagged(plain, orientation), encoding);
      ASSERT_TRUE(image) << image.error().detail;
      EXPECT_EQ(image->size(), cv::Size(32, 16)) << int{orientation};
    }
  }
  const std::string whole = tagged(plain, 6);
  EXPECT_EQ(decodeImage(whole.substr(0, whole.size() - 40), std::nullopt).error().code,
            "image_truncated")
      << "the thumbnail's end mark is not the image's";
}

TEST(Decode, BytesAfterTheEndMarkAreNoFault) {
  for (const char* extension : {".png", ".jpg"}) {
    const std::string whole = encoded(extension, colours());
    for (const std::string& trailer :
         {std::string(4096, '\0'), std::string(300, 'v'), whole, std::string("\xFF\xD8\xFF")}) {
      EXPECT_TRUE(decodeImage(whole + trailer, std::nullopt)) << extension << trailer.size();
    }
    const std::string lost = whole.substr(0, whole.size() - 3) + std::string(4096, '\0');
    EXPECT_FALSE(decodeImage(lost, std::nullopt)) << "a copy that was cut off and filled up";
  }
}

TEST(Decode, BytesThatAreNoImageAreCorrupt) {
  EXPECT_EQ(decodeImage("this is a text, not an image", std::nullopt).error().code,
            "image_corrupt");
}

TEST(Decode, AMissingFileIsNamed) {
  const auto image = decodeImageFile("/nowhere/7.png", std::nullopt);
  EXPECT_EQ(image.error().code, "image_missing");
  EXPECT_NE(image.error().detail.find("/nowhere/7.png"), std::string::npos);
}

TEST(Decode, UsedBitsAreThoseOfDeepImagesOnly) {
  const auto bitsOf = [](const std::string& name, const cv::Mat& image) {
    const std::string path = testing::TempDir() + "bits" + name;
    cv::imwrite(path, image);
    return usedBits(path);
  };
  EXPECT_EQ(bitsOf("12.png", cv::Mat(8, 8, CV_16UC1, cv::Scalar(4000))), 12);
  EXPECT_EQ(bitsOf("16.png", cv::Mat(8, 8, CV_16UC1, cv::Scalar(40000))), 16);
  EXPECT_EQ(bitsOf("10.tiff", cv::Mat(8, 8, CV_16UC1, cv::Scalar(1000))), 10);
  EXPECT_EQ(bitsOf("8.png", cv::Mat(8, 8, CV_8UC1, cv::Scalar(200))), 16);
  EXPECT_EQ(bitsOf("8.jpg", cv::Mat(8, 8, CV_8UC1, cv::Scalar(200))), 16);
  EXPECT_EQ(usedBits(testing::TempDir() + "no_such.png"), 16);
}

}  // namespace
}  // namespace perdure::vision
