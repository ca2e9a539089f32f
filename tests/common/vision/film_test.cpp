#include "common/vision/film.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>

namespace perdure::vision {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

/// Writes a film of 30 frames in which a disc moves over a ramp.
fs::path discFilm(const std::string& name, const std::string& codec) {
  const fs::path file = fs::temp_directory_path() / (std::to_string(getpid()) + name);
  const cv::Size size(96, 64);
  cv::VideoWriter writer(
      file.string(), cv::VideoWriter::fourcc(codec[0], codec[1], codec[2], codec[3]), 25.0, size);
  for (int i = 0; i < 30; ++i) {
    cv::Mat image(size, CV_8UC3);
    for (int r = 0; r < image.rows; ++r) {
      for (int c = 0; c < image.cols; ++c) image.at<cv::Vec3b>(r, c) = {60, uchar(2 * c), uchar(r)};
    }
    cv::circle(image, {10 + 2 * i, 32}, 8, cv::Scalar(230, 200, 240), cv::FILLED);
    writer.write(image);
  }
  return file;
}

double differenceOf(const cv::Mat& a, const cv::Mat& b) {
  return cv::norm(a, b, cv::NORM_L1) / static_cast<double>(a.total() * a.elemSize());
}

TEST(Film, EachFrameIsThatOfOpenCvInAnyOrder) {
  for (const auto& [name, codec] :
       {std::pair("disc.mp4", "mp4v"), {"disc.avi", "MJPG"}, {"disc.mkv", "FFV1"}}) {
    const fs::path file = discFilm(name, codec);
    std::vector<cv::Mat> frames;
    cv::VideoCapture capture(file.string());
    for (cv::Mat image; capture.read(image);) frames.push_back(image.clone());
    ASSERT_EQ(frames.size(), 30U) << name;
    const auto film = Film::open(file);
    ASSERT_TRUE(film) << name;
    EXPECT_EQ((*film)->size(), cv::Size(96, 64));
    ASSERT_EQ((*film)->times().size(), 30U);
    EXPECT_EQ((*film)->times()[10], std::chrono::milliseconds(400));
    for (const std::size_t index : {0, 1, 2, 25, 24, 3, 29, 29, 12, 11, 13, 0}) {
      const auto image = (*film)->at(index, ImageEncoding::kBgr8);
      ASSERT_TRUE(image);
      EXPECT_LT(differenceOf(*image, frames[index]), 1.5) << name << ", frame " << index;
    }
    EXPECT_EQ((*film)->at(4, ImageEncoding::kMono8)->type(), CV_8UC1);
    fs::remove(file);
  }
}

TEST(Film, AFileThatIsNoFilmIsRefused) {
  const fs::path file = fs::temp_directory_path() / (std::to_string(getpid()) + "no_film.mp4");
  std::ofstream(file) << "no film";
  const auto film = Film::open(file);
  ASSERT_FALSE(film);
  EXPECT_EQ(film.error().code, "film_unreadable");
  EXPECT_THAT(film.error().detail, HasSubstr("no_film.mp4 cannot be read as a film"));
  fs::remove(file);
}

TEST(Film, DamagedFramesAreReasonsAndTheOthersAreRead) {
  const fs::path file = discFilm("damaged.avi", "MJPG");
  {
    std::fstream bytes(file, std::ios::in | std::ios::out | std::ios::binary);
    std::string text(static_cast<std::size_t>(fs::file_size(file)), '\0');
    bytes.read(text.data(), static_cast<std::streamsize>(text.size()));
    std::size_t at = 0;
    for (int i = 0; i <= 7; ++i) at = text.find("\xFF\xD8\xFF", at + 1);
    bytes.clear();
    bytes.seekp(static_cast<std::streamoff>(at));
    bytes << std::string(200, '\0');
  }
  const auto film = Film::open(file);
  ASSERT_TRUE(film);
  std::size_t read = 0;
  for (std::size_t i = 0; i < (*film)->times().size(); ++i) {
    const auto image = (*film)->at(i, std::nullopt);
    if (image) {
      ++read;
    } else {
      EXPECT_EQ(i, 7U);
      EXPECT_EQ(image.error().code, "image_corrupt");
    }
  }
  EXPECT_EQ(read, (*film)->times().size() - 1);
  fs::remove(file);
}

}  // namespace
}  // namespace perdure::vision
